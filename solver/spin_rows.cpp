#include "solver/spin_rows.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// Bodies that cannot move are shared between islands and stay untouched.
void apply(const ContactBlock& block, SolverBodies& bodies, const Vec3& moment) {
    if (block.inv_mass_a > 0) bodies.velocity[block.a].w += bodies.motion[block.a].inv_inertia_W * moment;
    if (block.inv_mass_b > 0) bodies.velocity[block.b].w -= bodies.motion[block.b].inv_inertia_W * moment;
}

// The largest eigenvalue of K in the plane across n.
Real largest_rolling_response(const Mat3& K, const Vec3& n) {
    const Vec3 t1 = any_perpendicular(n), t2 = n.cross(t1);
    const Real a = t1.dot(K * t1), b = t2.dot(K * t2), c = t1.dot(K * t2);
    return 0.5 * (a + b) + std::hypot(0.5 * (a - b), c);
}

// How far the points of a block are from the centres of the bodies that can turn [m].
Real longest_arm(const ContactPool& pool, const ContactBlock& block) {
    Real arm = 0;
    for (int p = block.first; p < block.first + block.count; ++p) {
        const PointGeometry& g = pool.geometry[p];
        if (block.inv_mass_a > 0) arm = std::max(arm, g.core_a_A.norm() + g.radius_a);
        if (block.inv_mass_b > 0) arm = std::max(arm, g.core_b_B.norm() + g.radius_b);
    }
    return arm;
}

void warm_start(ContactPool& pool, BlockRange spins, SolverBodies& bodies, Real share) {
    for (int k = spins.begin; k < spins.end; ++k) {
        SpinRow& row = pool.spins[k];
        row.impulse += share * row.warm;
        apply(pool.blocks[row.block], bodies, share * row.warm);
    }
}

}  // namespace

Real normal_impulse(const ContactPool& pool, const ContactBlock& block) {
    Real sum = 0;
    for (int p = block.first; p < block.first + block.count; ++p) sum += pool.impulse[p].normal;
    return sum;
}

Vec3 turning_rate(const ContactBlock& block, const SolverBodies& bodies) {
    return bodies.velocity[block.a].w - bodies.velocity[block.b].w;
}

Vec3 spin_step(const SpinRow& row, const Vec3& n, const Vec3& turning, Real load) {
    const Real torsion = n.dot(row.impulse), most = row.torsional * load;
    const Real next = std::clamp(torsion - row.torsion_mass * n.dot(turning), -most, most);
    const Vec3 w = turning + (next - torsion) * (row.response * n);
    Vec3 rolling = row.impulse - torsion * n - row.rolling_mass * (w - n * n.dot(w));
    const Real bound = row.rolling * load, length = rolling.norm();
    if (length > bound) rolling *= bound / length;
    return rolling + next * n;
}

void build_spins(ContactPool& pool, BlockRange spins, const SolverBodies& bodies) {
    for (int k = spins.begin; k < spins.end; ++k) {
        SpinRow& row = pool.spins[k];
        const ContactBlock& block = pool.blocks[row.block];
        row.response.setZero();
        if (block.inv_mass_a > 0) row.response += bodies.motion[block.a].inv_inertia_W;
        if (block.inv_mass_b > 0) row.response += bodies.motion[block.b].inv_inertia_W;
        row.torsion_mass = 1 / block.n.dot(row.response * block.n);
        row.rolling_mass = 1 / largest_rolling_response(row.response, block.n);
        row.arm = longest_arm(pool, block);
    }
}

void scale_warm_spins(ContactPool& pool, BlockRange spins, Real scale) {
    for (int k = spins.begin; k < spins.end; ++k) pool.spins[k].warm *= scale;
}

void warm_start_spins_first(ContactPool& pool, BlockRange spins, SolverBodies& bodies) {
    warm_start(pool, spins, bodies, 0.5);
}

void warm_start_spins_second(ContactPool& pool, BlockRange spins, SolverBodies& bodies) {
    warm_start(pool, spins, bodies, 0.5);
}

void warm_start_spins_all(ContactPool& pool, BlockRange spins, SolverBodies& bodies) {
    warm_start(pool, spins, bodies, 1);
}

void hold_spins(ContactPool& pool, BlockRange spins, SolverBodies& bodies) {
    for (int k = spins.begin; k < spins.end; ++k) {
        SpinRow& row = pool.spins[k];
        const ContactBlock& block = pool.blocks[row.block];
        if (normal_impulse(pool, block) > 0) continue;
        apply(block, bodies, -row.impulse);
        row.impulse.setZero();
    }
}

Real sweep_spins(ContactPool& pool, BlockRange spins, SolverBodies& bodies) {
    Real change = 0;
    for (int k = spins.begin; k < spins.end; ++k) {
        SpinRow& row = pool.spins[k];
        const ContactBlock& block = pool.blocks[row.block];
        const Vec3 delta = spin_step(row, block.n, turning_rate(block, bodies), normal_impulse(pool, block)) - row.impulse;
        row.impulse += delta;
        apply(block, bodies, delta);
        change = std::max(change, row.arm * (row.response * delta).norm());
    }
    return change;
}

void close_spin_substep(ContactPool& pool, BlockRange spins) {
    for (int k = spins.begin; k < spins.end; ++k) {
        SpinRow& row = pool.spins[k];
        row.warm = row.impulse;
        row.total += row.impulse;
        row.impulse.setZero();
    }
}

}  // namespace cairn
