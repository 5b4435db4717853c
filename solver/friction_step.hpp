// The friction impulses of a point under every model of solver/si_model.hpp. Internal to this room.
#pragma once

#include "solver/contact_kernel.hpp"
#include "solver/si_model.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

struct Tangential {
    Real x, y;
};

// The friction impulses of a point nearest to `wanted` within the model's bounds.
inline Tangential bounded_friction(FrictionModel model, const Tangential& wanted, Real limit) {
    if (model == FrictionModel::kCone) {
        const Real length = std::hypot(wanted.x, wanted.y);
        return length > limit ? Tangential{wanted.x * (limit / length), wanted.y * (limit / length)} : wanted;
    }
    const Real y = model == FrictionModel::kOneDirection ? 0 : std::clamp(wanted.y, -limit, limit);
    return {std::clamp(wanted.x, -limit, limit), y};
}

// One step of a point's friction from the velocity `u`: the rows side by side, each from its own velocity. On the cone both take the same
// multiple of the slip, so that the force is along it: S is not a multiple of the identity, and a step by S⁻¹ v would turn it.
inline Tangential friction_step(FrictionModel model, Real relaxation, const FrictionRow* rows, const BlockVelocity& u,
                                const PointImpulse& impulse, Real limit) {
    Real m1 = relaxation * rows[0].mass, m2 = relaxation * rows[1].mass;
    if (model == FrictionModel::kCone) m1 = m2 = std::min(m1, m2);
    return bounded_friction(
        model, {impulse.friction[0] - m1 * u.along(rows[0].t, rows[0]), impulse.friction[1] - m2 * u.along(rows[1].t, rows[1])}, limit);
}

}  // namespace cairn
