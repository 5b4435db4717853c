#include "solver/direct_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn {
namespace {

using Velocities = std::vector<BodyVelocity>;

// Largest residual of a row by what geometry and impulses say, velocities being zero; infinite where impulses are not what the second
// solve starts with, or not within the bounds.
Real point_residual(const ContactPool& pool, const ContactBlock& block, int i, Real h, Real exact) {
    constexpr Real kRounding = 1e-12;
    const PointImpulse& impulse = pool.impulse[block.first + i];
    const WarmImpulse& warm = pool.warm[block.first + i];
    bool even = warm.velocity == warm.position;
    for (int j = 0; block.friction >= 0 && j < 2; ++j) {
        const Real bound = (1 + kRounding) * block.mu * impulse.normal;
        even &= warm.friction[j] == 2 * warm.friction_first[j] && std::abs(impulse.friction[j]) <= bound;
    }
    if (!even) return std::numeric_limits<Real>::infinity();
    // Penetrations are to be left; gaps are to be closed where something presses across them.
    const Real closing = closing_velocity(pool.normals[block.first + i], h, exact);
    return closing >= 0 || impulse.normal > 0 ? std::abs(closing) : 0.0;
}

// Largest ‖G v‖ of the rows of a block.
Real block_slip(const ContactPool& pool, const ContactBlock& block, const BlockVelocity& u) {
    Real slip = 0;
    for (int i = 0; i < block.count; ++i) {
        slip = std::max(slip, std::abs(u.along(block.n, pool.normals[block.first + i])));
        for (int j = 0; block.friction >= 0 && j < 2; ++j) {
            const FrictionRow& row = pool.frictions[block.friction + 2 * i + j];
            slip = std::max(slip, std::abs(u.along(row.t, row)));
        }
    }
    return slip;
}

// The velocities after the second solve, v₁ being there now.
BodyVelocity second_velocity(const SolverBodies& bodies, const SiIsland& island, const Velocities& v0, int i) {
    if (i < island.body_begin || i >= island.dynamic_end) return {};
    const BodyVelocity &u1 = bodies.velocity[i], &u0 = v0[i - island.body_begin];
    return {2 * u1.v - u0.v, 2 * u1.w - u0.w};
}

// At least the largest ‖G v‖ after either solve, from how fast the points of the bodies move: two of them at most twice as fast against
// each other.
Real slip_bound(const SolverBodies& bodies, const SiIsland& island, const Velocities& v0) {
    Real speed = 0;
    for (int i = island.body_begin; i < island.dynamic_end; ++i) {
        const BodyVelocity &u1 = bodies.velocity[i], u2 = second_velocity(bodies, island, v0, i);
        const Real r = bodies.motion[i].radius;
        speed = std::max({speed, u1.v.norm() + r * u1.w.norm(), u2.v.norm() + r * u2.w.norm()});
    }
    return 2 * speed;
}

Real largest_slip(const SolverBodies& bodies, const ContactPool& pool, const SiIsland& island, const Velocities& v0) {
    Real slip = 0;
    for (int k = island.contacts.begin; k < island.contacts.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        slip = std::max(slip, block_slip(pool, block, u));
        const BodyVelocity a = second_velocity(bodies, island, v0, block.a), b = second_velocity(bodies, island, v0, block.b);
        u.dv = a.v - b.v;
        u.wa = a.w;
        u.wb = b.w;
        slip = std::max(slip, block_slip(pool, block, u));
    }
    return slip;
}

// What rounding leaves of the balance of forces [m/s]: the speed that a body's weight and all its impulses would give its points if none
// took another back, the most of any body, times ε; errors of random signs add up as √n over the island's rows. kSlack covers what of this
// is estimated. And what it leaves of positions: x + h v is x for h v below ε x. Bodies' `push` serves as scratch.
Real rounding_of_balance(SolverBodies& bodies, const ContactPool& pool, const SiIsland& island, Real h) {
    constexpr Real kSlack = 8;
    for (int i = island.body_begin; i < island.dynamic_end; ++i) bodies.push[i].v.x() = h * bodies.motion[i].acceleration.norm();
    int rows = 0;
    for (int k = island.contacts.begin; k < island.contacts.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        Real speed_a = 0, speed_b = 0;
        const Real radius_a = bodies.motion[block.a].radius, radius_b = bodies.motion[block.b].radius;
        const auto add = [&](const PointRow& row, Real impulse) {
            speed_a += 2 * std::abs(impulse) * (block.inv_mass_a + radius_a * row.iang_a.norm());
            speed_b += 2 * std::abs(impulse) * (block.inv_mass_b + radius_b * row.iang_b.norm());
            ++rows;
        };
        for (int i = 0; i < block.count; ++i) {
            const PointImpulse& impulse = pool.impulse[block.first + i];
            add(pool.normals[block.first + i], impulse.normal);
            for (int j = 0; block.friction >= 0 && j < 2; ++j) add(pool.frictions[block.friction + 2 * i + j], impulse.friction[j]);
        }
        bodies.push[block.a].v.x() += speed_a;
        bodies.push[block.b].v.x() += speed_b;
    }
    Real most = 0, far = 0;
    for (int i = island.body_begin; i < island.dynamic_end; ++i) {
        most = std::max(most, bodies.push[i].v.x());
        far = std::max(far, bodies.motion[i].x.cwiseAbs().maxCoeff());
    }
    return std::numeric_limits<Real>::epsilon() * std::max(kSlack * std::sqrt(static_cast<Real>(rows)) * most, far / h);
}

bool a_kinematic_body_moves(const SolverBodies& bodies, const SiIsland& island) {
    for (int i = island.dynamic_end; i < island.body_end; ++i) {
        if (!bodies.velocity[i].v.isZero(0) || !bodies.velocity[i].w.isZero(0)) return true;
    }
    return false;
}

}  // namespace

Rest rests(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island, Real h, const Velocities& v0, Real enough, bool may_polish,
           DirectReport& report) {
    // Slower than what the bound allows for by this, the rows themselves are looked at: what sways as one has hardly any slip.
    constexpr Real kWorthALook = 100;
    // [m/s], more than rounding ever leaves: above it nobody needs to ask.
    constexpr Real kMostRounding = 1e-9;
    Real residual = slip_bound(bodies, island, v0);
    if (!(residual <= kWorthALook * enough) || a_kinematic_body_moves(bodies, island)) return Rest::kNo;
    ++report.passes;
    if (residual > enough) residual = largest_slip(bodies, contacts, island, v0);
    Real at_rest = 0;
    const Real exact = exact_correction(bodies, island, h);
    for (int k = island.contacts.begin; k < island.contacts.end && residual + at_rest <= enough; ++k) {
        for (int i = 0; i < contacts.blocks[k].count; ++i)
            at_rest = std::max(at_rest, point_residual(contacts, contacts.blocks[k], i, h, exact));
    }
    residual += at_rest;
    if (!(residual <= enough)) return Rest::kNo;
    const bool is_small = residual <= kMostRounding;
    const bool stands = is_small && residual <= rounding_of_balance(bodies, contacts, island, h);
    if (is_small && !stands && may_polish) return Rest::kNearly;
    report.residual = std::max(report.residual, residual);
    report.stands = stands;
    if (!report.stands) report.si.rotor_calls += drift(bodies, island.body_begin, island.dynamic_end, h);
    for (int i = island.body_begin; i < island.dynamic_end; ++i)
        bodies.velocity[i] = report.stands ? BodyVelocity{} : second_velocity(bodies, island, v0, i);
    const PointRange points = points_of(contacts, island.contacts);
    for (int p = points.begin; p < points.end; ++p) {
        PointImpulse &impulse = contacts.impulse[p], &total = contacts.total[p];
        total.normal += 2 * impulse.normal;
        for (int j = 0; j < 2; ++j) total.friction[j] += 2 * impulse.friction[j];
        impulse = {};
    }
    return Rest::kYes;
}

}  // namespace cairn
