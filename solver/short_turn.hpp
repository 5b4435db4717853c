// Rotations by small angles and quaternions near unit length, in closed form without roots, divisions or branches on the common way.
#pragma once

#include "engine/base/math.hpp"

namespace cairn {

// cos x and sin x / x from x², for x² <= 1/16: Taylor series to x¹² and x¹², which miss less than 1e-17. Without divisions or branches.
inline void short_trigonometry(Real x2, Real& cosine, Real& sine_over_x) {
    const Real x4 = x2 * x2, x8 = x4 * x4;
    cosine = (1 - x2 * (1.0 / 2)) + x4 * (1.0 / 24 - x2 * (1.0 / 720)) + x8 * (1.0 / 40320 - x2 * (1.0 / 3628800) + x4 * (1.0 / 479001600));
    sine_over_x =
        (1 - x2 * (1.0 / 6)) + x4 * (1.0 / 120 - x2 * (1.0 / 5040)) + x8 * (1.0 / 362880 - x2 * (1.0 / 39916800) + x4 * (1.0 / 6227020800));
}

// exp_rotation without a root or a branch for angles up to half a radian.
inline Quat exp_turn(const Vec3& phi) {
    const Real angle2 = phi.squaredNorm();
    if (angle2 > 0.25) return exp_rotation(phi);
    Real c, s;
    short_trigonometry(angle2 / 4, c, s);
    s *= 0.5;
    return Quat(c, s * phi.x(), s * phi.y(), s * phi.z());
}

// A quaternion that is off unit length by rounding, set right without a root: one Newton step towards 1 / ‖q‖.
inline Quat renormalised(const Quat& q) {
    const Real scale = 1.5 - 0.5 * q.squaredNorm();
    return Quat(scale * q.w(), scale * q.x(), scale * q.y(), scale * q.z());
}

// Free rotation with equal moments over h [s]: exact, ω stays.
inline void rotate_spherical(Quat& q, const Vec3& w, Real h) {
    q = renormalised(exp_turn(h * w) * q);
}

}  // namespace cairn
