#include "solver/mixed_step.hpp"

#include "solver/bounce.hpp"
#include "solver/contact_kernel.hpp"
#include "solver/rattle_rate.hpp"

#include <algorithm>

namespace cairn {
namespace {

// [rad], by which the fastest mode of a taut chain may turn in a substep (solver/rattle.hpp).
constexpr Real kTurnPerSubstep = 0.7;

}  // namespace

void MixedWorkspace::Data::Saved::save(const SolverBodies& bodies, const ContactPool& contacts, const SiIsland& island) {
    const PointRange p = points_of(contacts, island.contacts);
    motion.assign(bodies.motion.begin() + island.body_begin, bodies.motion.begin() + island.body_end);
    velocity.assign(bodies.velocity.begin() + island.body_begin, bodies.velocity.begin() + island.body_end);
    warm.assign(contacts.warm.begin() + p.begin, contacts.warm.begin() + p.end);
}

void MixedWorkspace::Data::Saved::restore(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island) const {
    const PointRange p = points_of(contacts, island.contacts);
    std::copy(motion.begin(), motion.end(), bodies.motion.begin() + island.body_begin);
    std::copy(velocity.begin(), velocity.end(), bodies.velocity.begin() + island.body_begin);
    std::copy(warm.begin(), warm.end(), contacts.warm.begin() + p.begin);
    std::fill(contacts.impulse.begin() + p.begin, contacts.impulse.begin() + p.end, PointImpulse{});
    std::fill(contacts.total.begin() + p.begin, contacts.total.begin() + p.end, PointImpulse{});
    for (int k = island.contacts.begin; k < island.contacts.end; ++k) build_block(contacts, contacts.blocks[k], bodies);
}

MixedStart MixedStepBase::begin_rows() {
    plan_ = &ws_.plans.find(joints_, island_.joints, bodies_, first(), settings_.max_flops);
    if (plan_->is_too_costly) return MixedStart::kTooCostly;
    ws_.rows.gather(joints_, island_.joints, bodies_, *plan_);
    rows_ = plan_->pattern.rows();
    ws_.start.resize(island_.body_end - island_.body_begin);
    for (std::vector<Real>* v : {&ws_.warm_first, &ws_.warm_second, &ws_.first, &ws_.second, &ws_.total, &ws_.gap, &ws_.start_gap,
                                 &ws_.pushed, &ws_.target, &ws_.bias, &ws_.residual})
        v->assign(rows_, 0);
    bodies_.push.resize(bodies_.velocity.size());
    for_each_listed_joint(joints_, island_.joints, [&](auto kind, const auto& j, int i) {
        constexpr int N = joint_rows(decltype(kind)::value);
        const int row = ws_.rows.list()[i].first;
        Eigen::Map<VecN<N>>(&ws_.warm_first[row]) = j.warm_first;
        Eigen::Map<VecN<N>>(&ws_.warm_second[row]) = j.warm_second;
    });
    size_ = largest_arm(joints_, island_.joints, bodies_);
    errors();
    ws_.gap = ws_.residual;
    return MixedStart::kReady;
}

int MixedStepBase::parts_for_tension() {
    for (int r = 0; r < rows_; ++r) ws_.residual[r] = (ws_.warm_first[r] + ws_.warm_second[r]) / h_;
    ws_.stiffness.resize(island_.dynamic_end - first());
    const Real rate = joint_motion(bodies_, joints_, island_, ws_.rows, ws_.residual.data(), size_, ws_.stiffness).tension;
    int parts = 1;
    while (parts < kMostMixedParts && rate * h_ > kTurnPerSubstep * parts) parts *= 2;
    return parts;
}

void MixedStepBase::cut(int parts) {
    h_ /= parts;
    for (int r = 0; r < rows_; ++r) {
        ws_.warm_first[r] /= parts;
        ws_.warm_second[r] /= parts;
    }
}

Real MixedStepBase::largest_gap() const {
    Real largest = 0;
    for (int r = 0; r < rows_; ++r) largest = std::max(largest, std::abs(ws_.gap[r]));
    return largest;
}

// Where the joints are to be at the end of the drift: together, or nearer by what the closing speed allows.
void MixedStepBase::set_target() {
    Real largest = 0;
    for (int r = 0; r < rows_; ++r) largest = std::max(largest, std::abs(ws_.start_gap[r]));
    const Real most = settings_.closing_speed * h_, left = largest > most ? 1 - most / largest : 0;
    for (int r = 0; r < rows_; ++r) ws_.target[r] = left * ws_.start_gap[r];
}

void MixedStepBase::remember_start() {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        const BodyMotion& m = bodies_.motion[i];
        ws_.start[i - first()] = {m.x, m.q, Vec3::Zero()};
    }
}

// Poses at the end of a drift by the present velocities.
void MixedStepBase::trial() {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        MixedWorkspace::Data::Start& s = ws_.start[i - first()];
        BodyMotion& m = bodies_.motion[i];
        const BodyVelocity& u = bodies_.velocity[i];
        m.x = s.x + h_ * u.v;
        m.q = s.q;
        s.w_end = u.w;
        rotate_free(m.q, s.w_end, m.rotor, h_, 1);
        m.R = m.q.toRotationMatrix();
        report_.si.rotor_calls += m.rotor.kind != InertiaKind::kSpherical;
    }
}

// A trial; its gaps into `gap`, and the velocities that lead from them to the target into `residual`. Returns the largest way [m].
Real MixedStepBase::misses() {
    trial();
    errors();
    Real largest = 0;
    for (int r = 0; r < rows_; ++r) {
        ws_.gap[r] = ws_.residual[r];
        const Real way = ws_.target[r] - ws_.residual[r];
        ws_.residual[r] = way / h_;
        largest = std::max(largest, std::abs(way));
    }
    return largest;
}

bool MixedStepBase::is_slack(Real largest) const {
    Real start = 0;
    for (int r = 0; r < rows_; ++r) start = std::max(start, std::abs(ws_.start_gap[r]));
    return largest <= settings_.slack * size_ + start;
}

void MixedStepBase::finish_drift() {
    Real most = 0;
    for (int i = first(); i < island_.dynamic_end; ++i) {
        BodyMotion& m = bodies_.motion[i];
        BodyVelocity& u = bodies_.velocity[i];
        u.w = ws_.start[i - first()].w_end;
        const Real turn = h_ * u.w.norm();
        m.turned += turn;
        most = std::max(most, turn);
        moved_ += h_ * u.v.norm() + size_ * turn;
        if (m.rotor.kind != InertiaKind::kSpherical && turn > 0) m.inv_inertia_W = m.R * m.inv_inertia_B * m.R.transpose();
    }
    turned_ += most;
    response_turned_ += most;
}

void MixedStepBase::note_second() {
    for (int r = 0; r < rows_; ++r) ws_.residual[r] = ws_.first[r] + ws_.second[r];
    probe_->note_solve(SolveTurn::kSecond, bodies_, contacts_, ws_.rows, ws_.residual);
    build_joints(joints_, island_.joints, bodies_);
    probe_->measure(bodies_, contacts_, contacts_.impulse, joints_);
}

bool MixedStepBase::substep() {
    if (probe_) probe_->begin_substep(bodies_, h_);
    if (island_.has_bounce) {
        predict_bounces(contacts_, island_.contacts, bodies_, h_, true);
        turned_ = std::numeric_limits<Real>::infinity();  // rows are built along the normals of the impacts
        follow_turn();
    }
    if (!first_solve() || !push()) return false;
    finish_drift();
    if (moved_ > kKeepFactor * size_) renew_joints();
    advance_blocks(contacts_, island_.contacts, bodies_, h_, admitted_lag(settings_.rebuild_angle, h_));
    follow_turn();
    release_contacts(contacts_, island_.contacts);
    end_push(bodies_, first(), island_.dynamic_end);
    if (probe_) probe_->note_drift(bodies_, true);
    second_solve();
    end_substep();
    return true;
}

void MixedStepBase::end_substep() {
    if (probe_) note_second();
    close_contact_substep(contacts_, island_.contacts, FirstFriction::kHalf);
    for (int r = 0; r < rows_; ++r) ws_.total[r] += ws_.first[r] + ws_.second[r];
    std::swap(ws_.warm_first, ws_.first);
    std::swap(ws_.warm_second, ws_.second);
}

void MixedStepBase::store(Real warm_scale) {
    for_each_listed_joint(joints_, island_.joints, [&](auto kind, auto& j, int i) {
        constexpr int N = joint_rows(decltype(kind)::value);
        const int row = ws_.rows.list()[i].first;
        j.warm_first = warm_scale * Eigen::Map<const VecN<N>>(&ws_.warm_first[row]);
        j.warm_second = warm_scale * Eigen::Map<const VecN<N>>(&ws_.warm_second[row]);
        j.total = Eigen::Map<const VecN<N>>(&ws_.total[row]);
    });
}

}  // namespace cairn
