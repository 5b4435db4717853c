#include "solver/contact_models.hpp"

#include "solver/friction_step.hpp"

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

}  // namespace

Real target_velocity(const NormalRow& row, const SiModel& model, const RowTargets& t) {
    if (row.lift > 0) return row.bounce;
    if (row.separation > 0) return model.complementarity ? -row.separation / t.h : 0;
    return std::min(-t.beta * row.separation / t.h, t.push);
}

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
            const Tangential next =
                friction_step(model.friction, model.relaxation, rows, u, impulse, block.mu * std::max(impulse.normal, 0.0));
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

}  // namespace cairn
