// Rotation of a free rigid body.
//
// The equations are those of Euler in the body's principal frame P: q̇ = ½ q ω_P, L̇_P = L_P × ω_P with L_P = diag(I) ω_P. The flow conserves
// L_W = R L_P exactly (to rounding) and energy to the order of the method:
//   spherical   (I₁ = I₂ = I₃)     exact: one rotation about ω
//   symmetric   (two equal)        exact: q(t) = exp(t L_W / I⊥) q₀ exp(t (1 − I∥/I⊥) ω∥ e∥)
//   general                        the splitting of the free rigid body in three rotations about the principal axes, composed
//                                  symmetrically (Dullweber, Leimkuhler, McLachlan 1997), to 4th order by Suzuki (1990) where asked for
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>

namespace cairn {

enum class InertiaKind : std::uint8_t { kSpherical, kSymmetric, kGeneral };

// Principal inertia of a body as the rotor wants it.
struct RotorInertia {
    Vec3 moments = Vec3::Ones();      // [kg m²], in P
    Vec3 inv_moments = Vec3::Ones();  // [1/(kg m²)]
    Quat R_BP = Quat::Identity();     // principal frame in the body frame
    bool is_aligned = true;           // R_BP is the identity
    InertiaKind kind = InertiaKind::kSpherical;
    int symmetry_axis = 2;  // kSymmetric: the axis of P whose moment differs
};

// Sorts a body's moments into a kind: moments closer than 1e-12 relative count as equal.
RotorInertia make_rotor_inertia(const Vec3& moments, const Quat& R_BP);

// Advances body-to-world rotation q and angular velocity w [rad/s, world] by h [s] without torque.
// `stages`: 1 for the 2nd-order splitting, 5 for the 4th-order one, 10 for two of these in a row; matters for kGeneral only.
void rotate_free(Quat& q, Vec3& w, const RotorInertia& inertia, Real h, int stages);

// Stages that keep the error of one step of h near rounding of what the motion needs: one while the body turns by little, else five; ten
// where five miss by some 1e-8 of the turn.
inline int rotor_stages(const Vec3& w, Real h) {
    const Real turn2 = w.squaredNorm() * h * h;
    return turn2 < 1e-6 ? 1 : turn2 < 1e-3 ? 5 : 10;
}

}  // namespace cairn
