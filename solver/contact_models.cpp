#include "solver/contact_models.hpp"

#include "solver/contact_kernel.hpp"

#include <algorithm>

namespace cairn {
namespace {

// The impulse after a correction.
Real clamped(Clamp clamp, Real accumulated, Real correction) {
    switch (clamp) {
        case Clamp::kNone:
            return accumulated + correction;
        case Clamp::kPerIteration:
            return accumulated + std::max(correction, 0.0);
        case Clamp::kAccumulated:
            break;
    }
    return std::max(accumulated + correction, 0.0);
}

// Without a clamp the row is an equation, so with complementarity it may exist only where C <= 0.
bool is_active(const NormalRow& row, const SiModel& model) {
    return model.clamp != Clamp::kNone || !model.complementarity || row.separation <= 0;
}

Real target_velocity(const NormalRow& row, const SiModel& model, const RowTargets& t) {
    if (row.lift > 0) return row.bounce;
    if (row.separation > 0) return model.complementarity ? -row.separation / t.h : 0;
    return std::min(-t.beta * row.separation / t.h, t.push);
}

struct Tangential {
    Real x, y;
};

// The friction impulses of a point nearest to `wanted` within the model's bounds.
Tangential bounded(FrictionModel model, const Tangential& wanted, Real limit) {
    if (model == FrictionModel::kCone) {
        const Real length = std::hypot(wanted.x, wanted.y);
        return length > limit ? Tangential{wanted.x * (limit / length), wanted.y * (limit / length)} : wanted;
    }
    const Real y = model == FrictionModel::kOneDirection ? 0 : std::clamp(wanted.y, -limit, limit);
    return {std::clamp(wanted.x, -limit, limit), y};
}

// One step of a point's friction from the velocity `u`: the rows side by side, each from its own velocity. On the cone both take the same
// multiple of the slip, so that the force is along it: S is not a multiple of the identity, and a step by S⁻¹ v would turn it.
Tangential friction_step(const SiModel& model, const FrictionRow* rows, const BlockVelocity& u, const PointImpulse& impulse, Real limit) {
    Real m1 = model.relaxation * rows[0].mass, m2 = model.relaxation * rows[1].mass;
    if (model.friction == FrictionModel::kCone) m1 = m2 = std::min(m1, m2);
    return bounded(model.friction,
                   {impulse.friction[0] - m1 * u.along(rows[0].t, rows[0]), impulse.friction[1] - m2 * u.along(rows[1].t, rows[1])}, limit);
}

}  // namespace

Real sweep_normals(ContactPool& pool, BlockRange range, SolverBodies& bodies, const SiModel& model, const RowTargets& targets) {
    Real change = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        for (int i = block.first; i < block.first + block.count; ++i) {
            const NormalRow& row = pool.normals[i];
            if (!is_active(row, model)) continue;
            const Softness soft = row.separation < 0 ? targets.soft : Softness{};
            Real& lambda = pool.impulse[i].normal;
            const Real error = u.along(block.n, row) - target_velocity(row, model, targets);
            const Real correction = -model.relaxation * soft.mass_scale * row.mass * error - soft.impulse_scale * lambda;
            const Real next = clamped(model.clamp, lambda, correction);
            u.apply(block, block.n, row, next - lambda);
            change = std::max(change, std::abs(next - lambda) * block.max_inv_mass);
            lambda = next;
        }
        u.store(block, bodies);
    }
    return change;
}

Real sweep_frictions(ContactPool& pool, BlockRange range, SolverBodies& bodies, const SiModel& model) {
    Real change = 0;
    if (model.friction == FrictionModel::kNone) return change;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        if (block.friction < 0) continue;
        BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            PointImpulse& impulse = pool.impulse[block.first + i];
            const FrictionRow* rows = &pool.frictions[block.friction + 2 * i];
            const Tangential next = friction_step(model, rows, u, impulse, block.mu * std::max(impulse.normal, 0.0));
            const Real delta[2] = {next.x - impulse.friction[0], next.y - impulse.friction[1]};
            // Not += delta, which would round past the bound where the impulse was large before.
            impulse.friction[0] = next.x;
            impulse.friction[1] = next.y;
            for (int j = 0; j < 2; ++j) {
                u.apply(block, rows[j].t, rows[j], delta[j]);
                change = std::max(change, std::abs(delta[j]) * block.max_inv_mass);
            }
        }
        u.store(block, bodies);
    }
    return change;
}

Real contact_residual(const ContactPool& pool, BlockRange range, const SolverBodies& bodies, const SiModel& model,
                      const RowTargets& targets) {
    SiModel plain = model;
    plain.relaxation = 1;
    Real residual = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        const BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            const NormalRow& row = pool.normals[block.first + i];
            const PointImpulse& impulse = pool.impulse[block.first + i];
            const Real error = u.along(block.n, row) - target_velocity(row, {}, targets);
            residual =
                std::max(residual, std::abs(clamped(Clamp::kAccumulated, impulse.normal, -row.mass * error) - impulse.normal) / row.mass);
            if (block.friction < 0 || model.friction == FrictionModel::kNone) continue;
            const FrictionRow* rows = &pool.frictions[block.friction + 2 * i];
            const Tangential next = friction_step(plain, rows, u, impulse, block.mu * std::max(impulse.normal, 0.0));
            residual = std::max(
                {residual, std::abs(next.x - impulse.friction[0]) / rows[0].mass, std::abs(next.y - impulse.friction[1]) / rows[1].mass});
        }
    }
    return residual;
}

}  // namespace cairn
