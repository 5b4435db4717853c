// Soft constraints: a row behaves as a damped spring of frequency f and damping ratio ζ, integrated implicitly (Catto 2011, "Soft
// constraints"). The coefficients depend on hω = 2π f h alone; the frequency follows the step (f ∝ 1/h), so what a row gives way falls as
// h².
#pragma once

#include "engine/base/math.hpp"

namespace cairn {

// Target velocity of a row: −rate C / h; impulse step: Δλ = −mass_scale (Jv + rate C / h) / S − impulse_scale λ. The default is rigid.
struct Softness {
    Real rate = 1;
    Real mass_scale = 1;
    Real impulse_scale = 0;
};

inline Softness make_softness(Real h_omega, Real damping_ratio) {
    const Real a1 = 2 * damping_ratio + h_omega;
    const Real a2 = h_omega * a1;
    return {h_omega / a1, a2 / (1 + a2), 1 / (1 + a2)};
}

}  // namespace cairn
