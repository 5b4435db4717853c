#include "solver/rotor.hpp"

#include "solver/short_turn.hpp"

#include <algorithm>

namespace cairn {
namespace {

// A rotation that turns as the splitting goes, and its angular momentum; both in plain scalars, so that they stay in registers.
struct Rotor {
    Real w, v[3];  // q_WP
    Real L[3];     // L_P [N m s]
};

// Turns q by `angle` about principal axis K (from the right: the axis is fixed in the body) and L_P by the opposite angle.
template <int K>
inline void turn_about_axis(Rotor& r, Real angle) {
    Real c, s;  // of angle / 2
    const Real half = 0.5 * angle;
    if (half * half <= 1.0 / 16) {
        short_trigonometry(half * half, c, s);
        s *= half;
    } else {
        c = std::cos(half);
        s = std::sin(half);
    }
    constexpr int I = (K + 1) % 3, J = (K + 2) % 3;
    // q (c + s e_K)
    const Real w = r.w, vk = r.v[K], vi = r.v[I], vj = r.v[J];
    r.w = c * w - s * vk;
    r.v[K] = c * vk + s * w;
    r.v[I] = c * vi + s * vj;
    r.v[J] = c * vj - s * vi;
    const Real cosine = c * c - s * s, sine = 2 * s * c;
    const Real Li = r.L[I], Lj = r.L[J];
    r.L[I] = cosine * Li + sine * Lj;
    r.L[J] = cosine * Lj - sine * Li;
}

// One symmetric splitting step: ½·1, ½·2, 3, ½·2, ½·1.
void strang_step(Rotor& r, const Vec3& inv_moments, Real h) {
    turn_about_axis<0>(r, 0.5 * h * r.L[0] * inv_moments[0]);
    turn_about_axis<1>(r, 0.5 * h * r.L[1] * inv_moments[1]);
    turn_about_axis<2>(r, h * r.L[2] * inv_moments[2]);
    turn_about_axis<1>(r, 0.5 * h * r.L[1] * inv_moments[1]);
    turn_about_axis<0>(r, 0.5 * h * r.L[0] * inv_moments[0]);
}

void rotate_general(Quat& q, Vec3& w, const RotorInertia& inertia, Real h, int stages) {
    // An R_BP off unit length by rounding would scale L in each call.
    const Quat start = inertia.is_aligned ? renormalised(q) : Quat((q * inertia.R_BP).normalized());
    const Vec3 L_P = inertia.moments.cwiseProduct(start.conjugate() * w);
    const Vec3& inv_moments = inertia.inv_moments;
    Rotor r{start.w(), {start.x(), start.y(), start.z()}, {L_P[0], L_P[1], L_P[2]}};
    if (stages == 1) {
        strang_step(r, inv_moments, h);
    } else {
        constexpr Real kOuter = 0.41449077179437573714;  // 1 / (4 − 4^{1/3})
        const Real part = 5 * h / stages;
        for (int k = 0; k < stages; ++k) strang_step(r, inv_moments, (k % 5 == 2 ? 1 - 4 * kOuter : kOuter) * part);
    }
    const Quat q_WP = renormalised(Quat(r.w, r.v[0], r.v[1], r.v[2]));
    w = q_WP * Vec3(r.L[0] * inv_moments[0], r.L[1] * inv_moments[1], r.L[2] * inv_moments[2]);
    q = inertia.is_aligned ? q_WP : Quat(q_WP * inertia.R_BP.conjugate());
}

// Column K of q's matrix.
template <int K>
inline Vec3 axis_of(const Quat& q) {
    constexpr int I = (K + 1) % 3, J = (K + 2) % 3;
    const Real v[3] = {q.x(), q.y(), q.z()}, w = q.w();
    Vec3 a;
    a[K] = 1 - 2 * (v[I] * v[I] + v[J] * v[J]);
    a[I] = 2 * (v[K] * v[I] + w * v[J]);
    a[J] = 2 * (v[K] * v[J] - w * v[I]);
    return a;
}

// Symmetry axis K of the principal frame: L turns the body about itself, the rest of the spin about the axis.
template <int K>
inline void rotate_symmetric(Quat& q_WP, Vec3& w, const RotorInertia& inertia, Real h) {
    const Vec3 axis = axis_of<K>(q_WP);
    const Real ratio = inertia.moments[K] * inertia.inv_moments[(K + 1) % 3], own = (1 - ratio) * axis.dot(w);
    const Vec3 precession = w - own * axis;  // L_W / I⊥
    const Quat q = exp_turn(h * precession) * q_WP;
    Rotor r{q.w(), {q.x(), q.y(), q.z()}, {0, 0, 0}};
    turn_about_axis<K>(r, h * own);
    q_WP = renormalised(Quat(r.w, r.v[0], r.v[1], r.v[2]));
    w = precession + own * axis_of<K>(q_WP);
}

void rotate_symmetric(Quat& q, Vec3& w, const RotorInertia& inertia, Real h) {
    Quat q_WP = inertia.is_aligned ? q : Quat((q * inertia.R_BP).normalized());
    switch (inertia.symmetry_axis) {
        case 0:
            rotate_symmetric<0>(q_WP, w, inertia, h);
            break;
        case 1:
            rotate_symmetric<1>(q_WP, w, inertia, h);
            break;
        default:
            rotate_symmetric<2>(q_WP, w, inertia, h);
    }
    q = inertia.is_aligned ? q_WP : Quat(q_WP * inertia.R_BP.conjugate());
}

}  // namespace

RotorInertia make_rotor_inertia(const Vec3& moments, const Quat& R_BP) {
    RotorInertia r;
    r.moments = moments;
    r.inv_moments = moments.cwiseInverse();
    r.R_BP = R_BP;
    r.is_aligned = R_BP.vec().isZero(0);
    const Real tolerance = 1e-12 * moments.maxCoeff();
    bool equal[3];  // equal[k]: the two moments other than k
    for (int k = 0; k < 3; ++k) equal[k] = std::abs(moments[(k + 1) % 3] - moments[(k + 2) % 3]) <= tolerance;
    if (equal[0] && equal[1] && equal[2]) {
        r.kind = InertiaKind::kSpherical;
    } else if (equal[0] || equal[1] || equal[2]) {
        r.kind = InertiaKind::kSymmetric;
        r.symmetry_axis = equal[0] ? 0 : equal[1] ? 1 : 2;
    } else {
        r.kind = InertiaKind::kGeneral;
    }
    return r;
}

void rotate_free(Quat& q, Vec3& w, const RotorInertia& inertia, Real h, int stages) {
    switch (inertia.kind) {
        case InertiaKind::kSpherical:
            rotate_spherical(q, w, h);
            return;
        case InertiaKind::kSymmetric:
            rotate_symmetric(q, w, inertia, h);
            return;
        case InertiaKind::kGeneral:
            rotate_general(q, w, inertia, h, stages);
            return;
    }
}

}  // namespace cairn
