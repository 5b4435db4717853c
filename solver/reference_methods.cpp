#include "solver/reference_methods.hpp"

#include "solver/contact_kernel.hpp"

namespace cairn {
namespace {

// Calls f(point index) for all points of the range.
template <typename Function>
void for_each_point(const ContactPool& pool, BlockRange range, Function f) {
    for (int k = range.begin; k < range.end; ++k)
        for (int p = pool.blocks[k].first; p < pool.blocks[k].first + pool.blocks[k].count; ++p) f(p);
}

PointImpulse sum(const PointImpulse& a, Real scale, const PointImpulse& b) {
    return {a.normal + scale * b.normal, {a.friction[0] + scale * b.friction[0], a.friction[1] + scale * b.friction[1]}};
}

Real squared(const PointImpulse& a) {
    return a.normal * a.normal + a.friction[0] * a.friction[0] + a.friction[1] * a.friction[1];
}

// λ += scale p, v += scale M⁻¹ Gᵀ p.
void apply_direction(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real scale) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            const int p = block.first + i;
            const PointImpulse& direction = pool.direction[p];
            pool.impulse[p] = sum(pool.impulse[p], scale, direction);
            u.apply(block, block.n, pool.normals[p], scale * direction.normal);
            if (block.friction < 0) continue;
            for (int j = 0; j < 2; ++j) {
                const FrictionRow& row = pool.frictions[block.friction + 2 * i + j];
                u.apply(block, row.t, row, scale * direction.friction[j]);
            }
        }
        u.store(block, bodies);
    }
}

}  // namespace

void nncg_begin(ContactPool& pool, BlockRange range) {
    if (pool.before.size() < pool.impulse.size()) {
        pool.before.resize(pool.impulse.size());
        pool.direction.resize(pool.impulse.size());
    }
    for_each_point(pool, range, [&](int p) {
        pool.before[p] = pool.impulse[p];
        pool.direction[p] = {};
    });
}

void nncg_carry_on(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real& gradient) {
    Real now = 0;
    for_each_point(pool, range, [&](int p) { now += squared(sum(pool.impulse[p], -1, pool.before[p])); });
    const Real beta = gradient > 0 ? now / gradient : 0;
    gradient = now;
    const bool restart = beta > 1;
    // p_k from the step of the sweep alone, so before λ is carried on.
    for_each_point(pool, range, [&](int p) { pool.before[p] = sum(pool.impulse[p], -1, pool.before[p]); });
    if (!restart && beta > 0) apply_direction(pool, range, bodies, beta);
    for_each_point(pool, range, [&](int p) {
        pool.direction[p] = restart ? PointImpulse{} : sum(pool.before[p], beta, pool.direction[p]);
        pool.before[p] = pool.impulse[p];
    });
}

}  // namespace cairn
