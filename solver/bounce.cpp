#include "solver/bounce.hpp"

#include "solver/contact_kernel.hpp"

#include <algorithm>

namespace cairn {
namespace {

struct Bounce {
    Real lift = 0;
    Real velocity = 0;
};

// Of a gap s that changes at v, under the acceleration a. All zero: nothing arrives within h, or it stays where it arrives.
Bounce find_bounce(Real s, Real v, Real a, Real h, Real restitution) {
    // First root τ of s + v τ + a τ²/2 = 0, in the form that does not cancel.
    const Real d = v * v - 2 * a * s;
    if (d < 0) return {};
    const Real root = std::sqrt(d);
    if (root - v <= 0) return {};
    const Real tau = 2 * s / (root - v);
    if (!(tau < h) || root == 0) return {};
    // It arrives with −root, leaves with e root, and flies on for h − τ.
    const Real rest = h - tau;
    const Real lift = (restitution * root + 0.5 * a * rest) * rest;
    if (lift <= 0) return {};  // back on the ground within the substep: it rests
    return {lift, restitution * root + a * rest};
}

Vec3 relative_acceleration(const ContactBlock& block, const SolverBodies& bodies) {
    return bodies.motion[block.a].acceleration * (block.inv_mass_a > 0) - bodies.motion[block.b].acceleration * (block.inv_mass_b > 0);
}

// core_a − core_b of a block's first point [m], world.
Vec3 core_distance(const ContactPool& pool, const ContactBlock& block, const SolverBodies& bodies) {
    const BodyMotion &a = bodies.motion[block.a], &b = bodies.motion[block.b];
    const PointGeometry& g = pool.geometry[block.first];
    return a.x + a.R * g.core_a_A - b.x - b.R * g.core_b_B;
}

// First time at which d + u t + a t²/2 has the length `reach`, or a negative number. `d` is longer than that.
Real first_meeting(const Vec3& d, const Vec3& u, const Vec3& a, Real reach) {
    // Without a it is the smaller root of u² t² + 2 d·u t + d² − reach² = 0, in the form that does not cancel.
    const Real b = d.dot(u), discriminant = b * b - u.squaredNorm() * (d.squaredNorm() - reach * reach);
    if (b >= 0 || discriminant < 0) return -1;
    Real t = (d.squaredNorm() - reach * reach) / (std::sqrt(discriminant) - b);
    if (a.isZero(0)) return t;
    for (int k = 0; k < 4; ++k) {  // Newton's method: each step squares the error
        const Vec3 x = d + t * u + 0.5 * t * t * a, v = u + t * a;
        const Real closing = x.dot(v);
        if (closing >= 0) return -1;
        t -= 0.5 * (x.squaredNorm() - reach * reach) / closing;
    }
    return t;
}

// Builds a block of two core points along the normal that it has when they meet within h, or else that of now.
void turn_to_impact(ContactPool& pool, ContactBlock& block, const SolverBodies& bodies, Real h, bool along_slip) {
    const PointGeometry& g = pool.geometry[block.first];
    const Vec3 d = core_distance(pool, block, bodies);
    const BodyVelocity &va = bodies.velocity[block.a], &vb = bodies.velocity[block.b];
    const Vec3 core_a = bodies.motion[block.a].R * g.core_a_A, core_b = bodies.motion[block.b].R * g.core_b_B;
    const Vec3 u = va.v + va.w.cross(core_a) - vb.v - vb.w.cross(core_b), a = relative_acceleration(block, bodies);
    const Real reach = g.radius_a + g.radius_b;
    const Real t = d.squaredNorm() > reach * reach ? first_meeting(d, u, a, reach) : -1;
    const bool meets = t >= 0 && t < h;
    block.n = direction_or(meets ? Vec3(d + t * u + 0.5 * t * t * a) : d, block.n);
    if (meets && along_slip && block.friction >= 0) {
        const Vec3 slip = u + t * a - va.w.cross(g.radius_a * block.n) - vb.w.cross(g.radius_b * block.n);
        pool.frictions[block.friction].t = slip - block.n * block.n.dot(slip);
    }
    // What is above zero tells build_block that n is that of an impact; the caller sets what it is.
    pool.normals[block.first].lift = meets ? 1 : 0;
    build_block(pool, block, bodies);
}

}  // namespace

void predict_bounces(ContactPool& pool, BlockRange range, const SolverBodies& bodies, Real h, bool along_slip) {
    for (int k = range.begin; k < range.end; ++k) {
        ContactBlock& block = pool.blocks[k];
        if (block.restitution == 0) continue;
        if (block.frame == NormalFrame::kCores) turn_to_impact(pool, block, bodies, h, along_slip);
        const BlockVelocity u(block, bodies);
        const Real a = block.n.dot(relative_acceleration(block, bodies));
        for (int i = block.first; i < block.first + block.count; ++i) {
            NormalRow& row = pool.normals[i];
            const Bounce bounce = find_bounce(std::max(row.separation, 0.0), u.along(block.n, row), a, h, block.restitution);
            row.lift = bounce.lift;
            row.bounce = bounce.velocity;
        }
    }
}

}  // namespace cairn
