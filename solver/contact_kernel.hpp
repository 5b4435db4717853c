// What every contact solver does with a row. Internal to this room.
#pragma once

#include "solver/contact_rows.hpp"

#include <algorithm>
#include <limits>

namespace cairn {

// Velocities of a block's two bodies, held in registers while its rows are visited: the relative linear velocity (all that rows see of the
// linear ones) and both angular ones.
struct BlockVelocity {
    Vec3 dv, wa, wb;

    BlockVelocity(const BodyVelocity& a, const BodyVelocity& b) : dv(a.v - b.v), wa(a.w), wb(b.w) {}
    BlockVelocity(const ContactBlock& block, const SolverBodies& bodies)
        : dv(bodies.velocity[block.a].v - bodies.velocity[block.b].v), wa(bodies.velocity[block.a].w), wb(bodies.velocity[block.b].w) {}

    // G v of a row.
    Real along(const Vec3& direction, const PointRow& row) const { return direction.dot(dv) + row.ang_a.dot(wa) - row.ang_b.dot(wb); }

    // v += M⁻¹ Gᵀ λ.
    void apply(const ContactBlock& block, const Vec3& direction, const PointRow& row, Real lambda) {
        dv += (block.inv_mass_sum * lambda) * direction;
        wa += lambda * row.iang_a;
        wb -= lambda * row.iang_b;
    }

    // Bodies that cannot move are shared between islands and stay untouched.
    void store(const ContactBlock& block, SolverBodies& bodies) const {
        const Vec3 change = dv - (bodies.velocity[block.a].v - bodies.velocity[block.b].v);
        if (block.inv_mass_a > 0) {
            bodies.velocity[block.a].v += block.share_a * change;
            bodies.velocity[block.a].w = wa;
        }
        if (block.inv_mass_b > 0) {
            bodies.velocity[block.b].v -= block.share_b * change;
            bodies.velocity[block.b].w = wb;
        }
    }

    // Moves the accumulated normal impulse λ towards G v = target, λ >= 0. Returns the change.
    Real solve_normal(const ContactBlock& block, const NormalRow& row, Real& lambda, Real target) {
        const Real next = std::max(lambda - row.mass * (along(block.n, row) - target), 0.0);
        const Real delta = next - lambda;
        lambda = next;
        apply(block, block.n, row, delta);
        return std::abs(delta);
    }
};

// The angle [rad] by which rows may lag behind their bodies in a substep of h. A lag that stayed as it is would leave an error that no
// shorter step takes away; so it falls as the step's own error does, below the substep of a step of 1/60 s.
inline Real admitted_lag(Real angle, Real h) {
    constexpr Real kUsual = 1.0 / 240;  // [s]
    const Real ratio = std::min(h / kUsual, 1.0);
    return angle * ratio * ratio;
}

// The relative normal velocity that takes a row to where it must be at the end of a drift of h.
inline Real gap_target(const NormalRow& row, Real h, Real rate) {
    const Real gap = row.separation + 0.5 * h * h * row.curvature - row.lift;
    return gap > 0 || row.lift > 0 ? -gap / h : -rate * gap / h;
}

// The relative normal velocity wanted at the end of a substep: none; after a bounce its own; −∞ for what has not arrived and is not held.
inline Real velocity_target(const NormalRow& row) {
    return !row.touching ? -std::numeric_limits<Real>::infinity() : row.lift > 0 ? row.bounce : 0.0;
}

}  // namespace cairn
