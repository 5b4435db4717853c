#include "solver/residual.hpp"

#include "solver/friction_step.hpp"
#include "solver/spin_rows.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// Radius of gyration about the axis of an angular row, 1 of the others; see the header. `s`: G M⁻¹ Gᵀ of the row.
template <int N>
Real row_length(const JointBlock<N>& j, int row, Real inv_mass_sum, Real s) {
    const bool is_linear = !(j.G_a.row(row).template head<3>().isZero(0) && j.G_b.row(row).template head<3>().isZero(0));
    return is_linear || !(s > 0) ? 1 : std::sqrt(inv_mass_sum / s);
}

template <int N>
void add_joint(const JointBlock<N>& j, const SolverBodies& bodies, bool biased, int kind, int index, ResidualMeasure& measure) {
    const BodyVelocity &a = bodies.velocity[j.a], &b = bodies.velocity[j.b];
    VecN<N> w = j.G_a.template leftCols<3>() * a.v + j.G_a.template rightCols<3>() * a.w + j.G_b.template leftCols<3>() * b.v +
                j.G_b.template rightCols<3>() * b.w;
    if (biased) w += j.bias;
    const Real inv_mass_sum = bodies.motion[j.a].inv_mass + bodies.motion[j.b].inv_mass;
    for (int r = 0; r < N; ++r) {
        const Real s = j.G_a.row(r).dot(j.W_a.col(r)) + j.G_b.row(r).dot(j.W_b.col(r));
        measure.add(std::abs(w[r]) * row_length<N>(j, r, inv_mass_sum, s), RowKind::kJoint, kind, index);
    }
}

}  // namespace

void add_contact_residual(const ContactPool& pool, BlockRange range, const std::vector<PointImpulse>& x, const SolverBodies& bodies,
                          FrictionModel friction, const RowTargets* textbook, ResidualMeasure& measure) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        const BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            const NormalRow& row = pool.normals[block.first + i];
            const PointImpulse& impulse = x[block.first + i];
            if (!(row.mass > 0)) continue;  // neither body answers
            const Real w = u.along(block.n, row) - (textbook ? target_velocity(row, {}, *textbook) : velocity_target(row));
            measure.add(std::abs(std::max(impulse.normal - row.mass * w, 0.0) - impulse.normal) / row.mass, RowKind::kNormal, 0, k);
            if (block.friction < 0 || friction == FrictionModel::kNone) continue;
            const FrictionRow* rows = &pool.frictions[block.friction + 2 * i];
            const Tangential next = friction_step(friction, 1, rows, u, impulse, block.mu * std::max(impulse.normal, 0.0));
            measure.add(std::abs(next.x - impulse.friction[0]) / rows[0].mass, RowKind::kFriction, 0, k);
            measure.add(std::abs(next.y - impulse.friction[1]) / rows[1].mass, RowKind::kFriction, 0, k);
        }
    }
}

void add_spin_residual(const ContactPool& pool, BlockRange spins, const SolverBodies& bodies, ResidualMeasure& measure) {
    for (int k = spins.begin; k < spins.end; ++k) {
        const SpinRow& row = pool.spins[k];
        const ContactBlock& block = pool.blocks[row.block];
        const Vec3 left = spin_step(row, block.n, turning_rate(block, bodies), normal_impulse(pool, block)) - row.impulse;
        const Real torsion = block.n.dot(left);
        measure.add(row.arm * std::abs(torsion) / row.torsion_mass, RowKind::kFriction, 0, row.block);
        measure.add(row.arm * (left - torsion * block.n).norm() / row.rolling_mass, RowKind::kFriction, 0, row.block);
    }
}

void add_joint_residual(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, bool biased,
                        ResidualMeasure& measure) {
    const auto add_all = [&](const auto& blocks, JointKind kind) {
        const int k = static_cast<int>(kind);
        for (int i = ranges.begin[k]; i < ranges.end[k]; ++i) add_joint(blocks[i], bodies, biased, k, i, measure);
    };
    add_all(pool.ball, JointKind::kBall);
    add_all(pool.hinge, JointKind::kHinge);
    add_all(pool.slider, JointKind::kSlider);
    add_all(pool.fixed, JointKind::kFixed);
    add_all(pool.distance, JointKind::kDistance);
}

}  // namespace cairn
