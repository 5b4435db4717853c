// Hash of state bits: two runs that agree to the last bit have equal hashes. FNV-1a (Fowler, Noll, Vo 1991), 64 bits.
#pragma once

#include "engine/base/math.hpp"

#include <bit>
#include <cstdint>

namespace cairn {

class Hasher {
public:
    void add(Real x) { add_bits(std::bit_cast<std::uint64_t>(x)); }
    std::uint64_t value() const { return value_; }

private:
    void add_bits(std::uint64_t bits) {
        for (int k = 0; k < 8; ++k) {
            value_ ^= (bits >> (8 * k)) & 0xff;
            value_ *= 1099511628211u;
        }
    }
    std::uint64_t value_ = 14695981039346656037u;
};

}  // namespace cairn
