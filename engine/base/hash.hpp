// Hash of state bits: two runs that agree to the last bit have equal hashes. FNV-1a (Fowler, Noll, Vo 1991), 64 bits.
#pragma once

#include "engine/base/math.hpp"

#include <bit>
#include <cstdint>

namespace cairn {

class Hasher {
public:
    void add(Real x) { add_word(std::bit_cast<std::uint64_t>(x)); }
    void add(const Vec3& v) {
        for (int k = 0; k < 3; ++k) add(v[k]);
    }
    void add(const Mat3& m) {
        for (int k = 0; k < 9; ++k) add(m.data()[k]);
    }
    void add(const Quat& q) { add(q.w()), add(q.x()), add(q.y()), add(q.z()); }
    void add_word(std::uint64_t bits) {
        for (int k = 0; k < 8; ++k) {
            value_ ^= (bits >> (8 * k)) & 0xff;
            value_ *= 1099511628211u;
        }
    }
    std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = 14695981039346656037u;
};

}  // namespace cairn
