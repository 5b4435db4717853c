#include "solver/mixed_tree.hpp"

#include "solver/contact_kernel.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

// Of the largest arm: joints that are farther apart share no anchor about which their bodies could turn.
constexpr Real kMostApart = 1e-3;
// Likewise: from so near one correction meets joints as well as the first solve has to; what it leaves is met after the push.
constexpr Real kNear = 1e-3;

JointPose pose_of(const BodyMotion& m) {
    return {m.x, m.R};
}

}  // namespace

MixedStart TreeStep::begin() {
    const MixedStart start = begin_rows();
    if (start != MixedStart::kReady) return start;
    if (!plan_->tree.is_forest || !(largest_gap() <= kMostApart * size_)) return MixedStart::kNotSo;
    ws_.tree.gather(plan_->tree, ws_.rows, first(), island_.dynamic_end);
    if (!ws_.tree_contacts.gather(ws_.tree, contacts_, island_.contacts, first(), island_.dynamic_end)) return MixedStart::kNotSo;
    renew_joints();
    turned_ = std::numeric_limits<Real>::infinity();
    follow_turn();
    return MixedStart::kReady;
}

void TreeStep::renew_joints() {
    ws_.tree.build(joints_, island_.joints, bodies_);
    if (probe_) ws_.rows.build(joints_, island_.joints, bodies_);
    ++report_.factorisations;
    moved_ = 0;
}

// Contact rows at the present poses, where they have changed enough.
void TreeStep::follow_turn() {
    if (turned_ <= admitted_lag(settings_.rebuild_angle, h_)) return;
    ws_.tree_contacts.build(contacts_, island_.contacts);
    turned_ = 0;
}

// What the drift adds to the linear prediction of C is −h/2 C̈ to second order. Returns how far the joints would miss if this were left as
// it was [m].
Real TreeStep::predict_bias() {
    const auto velocity_of = [&](int i) -> JointVelocity { return {bodies_.velocity[i].v, bodies_.velocity[i].w}; };
    Real largest = 0;
    for_each_listed_joint(joints_, island_.joints, [&](auto kind, const auto& j, int i) {
        constexpr JointKind K = decltype(kind)::value;
        constexpr int N = joint_rows(K);
        const VecN<N> b =
            -0.5 * h_ *
            joint_curvature<K>(j.geometry, pose_of(bodies_.motion[j.a]), pose_of(bodies_.motion[j.b]), velocity_of(j.a), velocity_of(j.b));
        const int row = ws_.rows.list()[i].first;
        for (int r = 0; r < N; ++r) {
            ws_.residual[row + r] = b[r] - ws_.bias[row + r];
            largest = std::max(largest, std::abs(ws_.residual[row + r]));
            ws_.bias[row + r] = b[r];
        }
    });
    return h_ * largest;
}

// Sweeps that have begun.
void TreeStep::solve(bool with_friction) {
    Real change = 0;
    for (int k = 0; k < settings_.sweeps; ++k) {
        change = ws_.tree_contacts.sweep(contacts_, with_friction);
        ++report_.si.contact_sweeps;
        if (change <= settings_.residual_tolerance) break;
    }
    ws_.tree.add_motion(ws_.tree_contacts.motion(), bodies_);
    report_.si.residual = change;
}

bool TreeStep::first_solve() {
    kick(bodies_, first(), island_.dynamic_end, 0.5 * h_);
    predict_bias();
    warm_start_first(contacts_, island_.contacts, bodies_);
    remember_start();
    ws_.tree.project(ws_.bias.data(), bodies_);
    ++report_.joint_solves;
    ws_.tree_contacts.begin_gaps(contacts_, island_.contacts, bodies_, h_, 0);
    solve(false);
    ws_.start_gap = ws_.target = ws_.gap;
    const Real missed = predict_bias();
    drift_kinematic(bodies_, island_.dynamic_end, island_.body_end, h_);
    bool is_met = true;
    if (missed > settings_.tolerance * size_) {
        ws_.tree.correct(ws_.residual.data(), bodies_);
        ++report_.joint_solves;
        if (missed > kNear * size_) is_met = shake(kNear * size_);
    }
    ws_.tree_contacts.note_impulses(contacts_, island_.contacts, false, ws_.tree);
    ws_.tree.joint_impulses(bodies_, ws_.first.data());
    return is_met;
}

bool TreeStep::push() {
    hold_contacts(contacts_, island_.contacts, bodies_);
    if (probe_) probe_->note_solve(SolveTurn::kFirst, bodies_, contacts_, ws_.rows, ws_.first);
    begin_push(bodies_, first(), island_.dynamic_end);
    ws_.tree_contacts.begin_gaps(contacts_, island_.contacts, bodies_, h_, settings_.contact_push);
    ws_.tree_contacts.sweep(contacts_, false);
    ws_.tree.add_motion(ws_.tree_contacts.motion(), bodies_);
    set_target();
    const bool is_met = shake(0);
    measure_push(bodies_, first(), island_.dynamic_end);
    return is_met;
}

// Corrections of the velocities until the trial pose meets the joints' target, or until one has been made from nearer than `near` [m]: the
// poses are then as they were before it.
bool TreeStep::shake(Real near) {
    Real last = std::numeric_limits<Real>::infinity();
    for (int k = 0;; ++k) {
        const Real largest = misses();
        if (largest <= settings_.tolerance * size_) return true;
        if (is_lost(k, largest, last)) return is_slack(largest);
        last = largest;
        ws_.tree.correct(ws_.residual.data(), bodies_);
        ++report_.joint_solves;
        if (largest <= near) return true;
    }
}

void TreeStep::second_solve() {
    kick(bodies_, first(), island_.dynamic_end, 0.5 * h_);
    warm_start_second(contacts_, island_.contacts, bodies_);
    ws_.tree.project(nullptr, bodies_);
    ++report_.joint_solves;
    ws_.tree_contacts.begin_velocities(contacts_, island_.contacts, bodies_);
    solve(true);
    ws_.tree_contacts.note_impulses(contacts_, island_.contacts, true, ws_.tree);
    ws_.tree.joint_impulses(bodies_, ws_.second.data());
}

}  // namespace cairn
