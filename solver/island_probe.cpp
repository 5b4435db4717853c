#include "solver/island_probe.hpp"

#include "solver/contact_kernel.hpp"
#include "solver/residual.hpp"

#include <algorithm>

namespace cairn {

void IslandProbe::begin(const SiIsland& island, FrictionModel friction) {
    island_ = island;
    friction_ = friction;
    residual_ = {};
    work_ = {};
}

void IslandProbe::begin_substep(const SolverBodies& bodies, Real h) {
    h_ = h;
    before_ = bodies.velocity;
    driven_.assign(bodies.velocity.size(), {});
    for (int i = island_.dynamic_end; i < island_.body_end; ++i) driven_[i] = bodies.velocity[i];
    std::fill(noted_.begin(), noted_.end(), PointImpulse{});
    std::fill(noted_spins_.begin(), noted_spins_.end(), Vec3(Vec3::Zero()));
    std::fill(noted_joints_.begin(), noted_joints_.end(), 0.0);
}

void IslandProbe::take_means(SolveTurn turn, const SolverBodies& bodies) {
    mean_ = driven_;
    const Real kick = turn == SolveTurn::kOnly ? 0 : turn == SolveTurn::kFirst ? -h_ / 4 : h_ / 4;
    for (int i = island_.body_begin; i < island_.dynamic_end; ++i) {
        const BodyMotion& m = bodies.motion[i];
        mean_[i].v = 0.5 * (before_[i].v + bodies.velocity[i].v) + kick * m.acceleration;
        mean_[i].w = 0.5 * (before_[i].w + bodies.velocity[i].w) + kick * (m.inv_inertia_W * m.torque);
    }
    before_ = bodies.velocity;
}

void IslandProbe::note_contacts(const ContactPool& contacts, const RowTargets* textbook) {
    if (noted_.size() < contacts.impulse.size()) noted_.resize(contacts.impulse.size());
    for (int k = island_.contacts.begin; k < island_.contacts.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const BlockVelocity mean(mean_[block.a], mean_[block.b]), driven(driven_[block.a], driven_[block.b]);
        for (int i = 0; i < block.count; ++i) {
            const NormalRow& row = contacts.normals[block.first + i];
            const PointImpulse& impulse = contacts.impulse[block.first + i];
            PointImpulse& noted = noted_[block.first + i];
            const Real delta = impulse.normal - noted.normal;
            // A gap that may close, and a bounce, are no stabilisation.
            const Real bias = textbook && row.separation < 0 && row.lift == 0 ? target_velocity(row, {}, *textbook) : 0;
            work_.stabilisation += 0.5 * delta * bias;
            work_.impacts += delta * (mean.along(block.n, row) - 0.5 * bias);
            work_.driven -= delta * driven.along(block.n, row);
            for (int j = 0; j < 2 && block.friction >= 0; ++j) {
                const FrictionRow& friction = contacts.frictions[block.friction + 2 * i + j];
                const Real rubbed = impulse.friction[j] - noted.friction[j];
                work_.friction += rubbed * mean.along(friction.t, friction);
                work_.driven -= rubbed * driven.along(friction.t, friction);
            }
            noted = impulse;
        }
    }
}

void IslandProbe::note_spins(const ContactPool& contacts) {
    const BlockRange spins = island_.spins;
    noted_spins_.resize(std::max<std::size_t>(noted_spins_.size(), spins.end - spins.begin), Vec3::Zero());
    for (int k = spins.begin; k < spins.end; ++k) {
        const SpinRow& row = contacts.spins[k];
        const ContactBlock& block = contacts.blocks[row.block];
        Vec3& noted = noted_spins_[k - spins.begin];
        const Vec3 delta = row.impulse - noted;
        work_.friction += delta.dot(mean_[block.a].w - mean_[block.b].w);
        work_.driven -= delta.dot(driven_[block.a].w - driven_[block.b].w);
        noted = row.impulse;
    }
}

template <int N>
void IslandProbe::note_joint(const JointBlock<N>& j, bool biased, Real* noted) {
    Eigen::Map<VecN<N>> known(noted);
    const auto along = [&](const std::vector<BodyVelocity>& u) -> VecN<N> {
        return j.G_a.template leftCols<3>() * u[j.a].v + j.G_a.template rightCols<3>() * u[j.a].w +
               j.G_b.template leftCols<3>() * u[j.b].v + j.G_b.template rightCols<3>() * u[j.b].w;
    };
    const VecN<N> delta = j.impulse - known;
    const Real bias = biased ? -0.5 * delta.dot(j.bias) : 0;
    work_.stabilisation += bias;
    work_.joints += delta.dot(along(mean_)) - bias;
    work_.driven -= delta.dot(along(driven_));
    known = j.impulse;
}

void IslandProbe::note_solve(SolveTurn turn, const SolverBodies& bodies, const ContactPool& contacts, const JointPool& joints,
                             const RowTargets* textbook) {
    take_means(turn, bodies);
    note_contacts(contacts, textbook);
    note_spins(contacts);
    noted_joints_.resize(std::max<std::size_t>(noted_joints_.size(), island_.joints.rows()));
    Real* noted = noted_joints_.data();
    const auto note_all = [&](const auto& blocks, JointKind kind) {
        const int k = static_cast<int>(kind);
        for (int i = island_.joints.begin[k]; i < island_.joints.end[k]; ++i, noted += joint_rows(kind))
            note_joint(blocks[i], textbook != nullptr, noted);
    };
    note_all(joints.ball, JointKind::kBall);
    note_all(joints.hinge, JointKind::kHinge);
    note_all(joints.slider, JointKind::kSlider);
    note_all(joints.fixed, JointKind::kFixed);
    note_all(joints.distance, JointKind::kDistance);
}

void IslandProbe::note_solve(SolveTurn turn, const SolverBodies& bodies, const ContactPool& contacts, const JointRowList& rows,
                             const std::vector<Real>& joint_impulses) {
    take_means(turn, bodies);
    note_contacts(contacts, nullptr);
    const std::size_t n = static_cast<std::size_t>(rows.rows());
    noted_joints_.resize(std::max(noted_joints_.size(), n));
    rows_mean_.resize(n);
    rows_driven_.resize(n);
    rows.velocities(mean_, rows_mean_.data());
    rows.velocities(driven_, rows_driven_.data());
    for (std::size_t r = 0; r < n; ++r) {
        const Real delta = joint_impulses[r] - noted_joints_[r];
        work_.joints += delta * rows_mean_[r];
        work_.driven -= delta * rows_driven_[r];
        noted_joints_[r] = joint_impulses[r];
    }
}

void IslandProbe::note_drift(const SolverBodies& bodies, bool pushed) {
    before_ = bodies.velocity;
    for (int i = island_.body_begin; pushed && i < island_.dynamic_end; ++i) {
        const BodyMotion& m = bodies.motion[i];
        work_.stabilisation -= h_ * (m.acceleration.dot(bodies.push[i].v) / m.inv_mass + m.torque.dot(bodies.push[i].w));
    }
}

void IslandProbe::note_moved(const BodyMotion& from, const BodyMotion& to) {
    work_.stabilisation -= from.acceleration.dot(to.x - from.x) / from.inv_mass;
}

void IslandProbe::measure(const SolverBodies& bodies, const ContactPool& contacts, const std::vector<PointImpulse>& x,
                          const JointPool& joints, const RowTargets* textbook) {
    add_contact_residual(contacts, island_.contacts, x, bodies, friction_, textbook, residual_);
    add_spin_residual(contacts, island_.spins, bodies, residual_);
    add_joint_residual(joints, island_.joints, bodies, textbook != nullptr, residual_);
}

}  // namespace cairn
