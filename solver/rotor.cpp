#include "solver/rotor.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Turns q by `angle` about principal axis k (from the right: the axis is fixed in the body) and L_P by the opposite angle.
void turn_about_axis(Quat& q_WP, Vec3& L_P, int k, Real angle) {
    Real c, s;  // of angle / 2
    if (std::abs(angle) < 1e-2) {
        const Real half2 = angle * angle / 4;
        c = 1 - half2 / 2 * (1 - half2 / 12 * (1 - half2 / 30));
        s = angle / 2 * (1 - half2 / 6 * (1 - half2 / 20 * (1 - half2 / 42)));
    } else {
        c = std::cos(angle / 2);
        s = std::sin(angle / 2);
    }
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    Real v[3] = {q_WP.x(), q_WP.y(), q_WP.z()};
    const Real w = q_WP.w();
    // q (c + s e_k)
    const Real vk = v[k], vi = v[i], vj = v[j];
    v[k] = c * vk + s * w;
    v[i] = c * vi + s * vj;
    v[j] = c * vj - s * vi;
    q_WP = Quat(c * w - s * vk, v[0], v[1], v[2]);
    const Real cosine = c * c - s * s, sine = 2 * s * c;
    const Real Li = L_P[i], Lj = L_P[j];
    L_P[i] = cosine * Li + sine * Lj;
    L_P[j] = cosine * Lj - sine * Li;
}

// One symmetric splitting step: ½·1, ½·2, 3, ½·2, ½·1.
void strang_step(Quat& q_WP, Vec3& L_P, const Vec3& inv_moments, Real h) {
    turn_about_axis(q_WP, L_P, 0, 0.5 * h * L_P[0] * inv_moments[0]);
    turn_about_axis(q_WP, L_P, 1, 0.5 * h * L_P[1] * inv_moments[1]);
    turn_about_axis(q_WP, L_P, 2, h * L_P[2] * inv_moments[2]);
    turn_about_axis(q_WP, L_P, 1, 0.5 * h * L_P[1] * inv_moments[1]);
    turn_about_axis(q_WP, L_P, 0, 0.5 * h * L_P[0] * inv_moments[0]);
}

void rotate_general(Quat& q, Vec3& w, const RotorInertia& inertia, Real h, int stages) {
    Quat q_WP = (q * inertia.R_BP).normalized();  // an R_BP off unit length by rounding would scale L in each call
    Vec3 L_P = inertia.moments.cwiseProduct(q_WP.conjugate() * w);
    const Vec3 inv_moments = inertia.moments.cwiseInverse();
    if (stages == 1) {
        strang_step(q_WP, L_P, inv_moments, h);
    } else {
        constexpr Real kOuter = 0.41449077179437573714;  // 1 / (4 − 4^{1/3})
        for (int k = 0; k < 5; ++k) strang_step(q_WP, L_P, inv_moments, (k == 2 ? 1 - 4 * kOuter : kOuter) * h);
    }
    q_WP.normalize();
    w = q_WP * L_P.cwiseProduct(inv_moments);
    q = q_WP * inertia.R_BP.conjugate();
}

void rotate_symmetric(Quat& q, Vec3& w, const RotorInertia& inertia, Real h) {
    const int k = inertia.symmetry_axis;
    const Real along = inertia.moments[k], across = inertia.moments[(k + 1) % 3];
    const Vec3 axis_B = inertia.R_BP * Vec3::Unit(k);
    const Vec3 axis_W = q * axis_B;
    const Real spin = axis_W.dot(w);
    const Vec3 precession = w + (along / across - 1) * spin * axis_W;  // L_W / I⊥
    q = exp_rotation(h * precession) * q * exp_rotation(h * (1 - along / across) * spin * axis_B);
    q.normalize();
    w = precession + (1 - along / across) * spin * (q * axis_B);
}

}  // namespace

RotorInertia make_rotor_inertia(const Vec3& moments, const Quat& R_BP) {
    RotorInertia r;
    r.moments = moments;
    r.R_BP = R_BP;
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
            q = exp_rotation(h * w) * q;
            q.normalize();
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
