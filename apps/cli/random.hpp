// Random numbers that are the same on every machine: the generator is fixed by the standard, its mapping to reals by us (the standard's
// distributions are not), and only +, −, ·, / and √ are used, which IEEE 754 rounds exactly.
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>
#include <random>

namespace cairn::cli {

class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}

    // Uniform in [lo, hi).
    Real uniform(Real lo, Real hi) { return lo + (hi - lo) * (static_cast<Real>(engine_() >> 11) * 0x1p-53); }

    // Uniform over all rotations (a point of the 4-ball, found by rejection, on its sphere).
    Quat rotation() {
        for (;;) {
            const Real w = uniform(-1, 1), x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
            const Real length2 = w * w + x * x + y * y + z * z;
            if (length2 > 1 || length2 < 1e-4) continue;
            const Real length = std::sqrt(length2);
            return Quat(w / length, x / length, y / length, z / length);
        }
    }

    // Uniform over all directions.
    Vec3 direction() {
        for (;;) {
            const Real x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
            const Real length2 = x * x + y * y + z * z;
            if (length2 > 1 || length2 < 1e-4) continue;
            const Real length = std::sqrt(length2);
            return Vec3(x / length, y / length, z / length);
        }
    }

private:
    std::mt19937_64 engine_;
};

}  // namespace cairn::cli
