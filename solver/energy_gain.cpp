#include "solver/energy_gain.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

BodyVelocity change_of(const SolverBodies& bodies, int i) {
    const BodyVelocity &before = bodies.push[i], &u = bodies.velocity[i];
    return {u.v - before.v, u.w - before.w};
}

}  // namespace

Real kinetic_product(const BodyMotion& body, const BodyVelocity& a, const BodyVelocity& b) {
    const RotorInertia& inertia = body.rotor;
    const Real linear = a.v.dot(b.v) / body.inv_mass;
    if (inertia.kind == InertiaKind::kSpherical) return linear + inertia.moments[0] * a.w.dot(b.w);
    Vec3 wa = body.R.transpose() * a.w, wb = body.R.transpose() * b.w;
    if (!inertia.is_aligned) {
        const Mat3 R_PB = inertia.R_BP.toRotationMatrix().transpose();
        wa = R_PB * wa;
        wb = R_PB * wb;
    }
    return linear + wa.dot(inertia.moments.cwiseProduct(wb));
}

void measure_gain(SolverBodies& bodies, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        const BodyVelocity &before = bodies.push[i], &u = bodies.velocity[i];
        bodies.gain[i] = 0.5 * kinetic_product(bodies.motion[i], change_of(bodies, i), {before.v + u.v, before.w + u.w});
    }
}

EnergyGain gain_of(const SolverBodies& bodies, int begin, int end) {
    EnergyGain gain;
    for (int i = begin; i < end; ++i) {
        gain.sum += bodies.gain[i];
        gain.moved += std::abs(bodies.gain[i]);
    }
    return gain;
}

Real lossless_share(const SolverBodies& bodies, int begin, int end, Real earlier) {
    Real slope = 0, curvature = 0;  // gain(s) = earlier + s slope + s² curvature
    for (int i = begin; i < end; ++i) {
        const BodyVelocity change = change_of(bodies, i);
        slope += kinetic_product(bodies.motion[i], bodies.push[i], change);
        curvature += 0.5 * kinetic_product(bodies.motion[i], change, change);
    }
    if (!(curvature > 0)) return 1;
    const Real square = slope * slope - 4 * curvature * earlier;
    return std::clamp((std::sqrt(std::max(square, 0.0)) - slope) / (2 * curvature), 0.0, 1.0);
}

void keep_share(SolverBodies& bodies, int begin, int end, Real share) {
    for (int i = begin; i < end; ++i) {
        const BodyVelocity& before = bodies.push[i];
        const BodyVelocity change = change_of(bodies, i);
        bodies.velocity[i] = {before.v + share * change.v, before.w + share * change.w};
    }
}

}  // namespace cairn
