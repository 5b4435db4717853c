#include "solver/mixed.hpp"

#include "solver/contact_kernel.hpp"
#include "solver/mixed_step.hpp"
#include "solver/mixed_tree.hpp"

#include <algorithm>
#include <limits>

namespace cairn {

MixedWorkspace::MixedWorkspace() : data_(std::make_unique<Data>()) {}
MixedWorkspace::~MixedWorkspace() = default;
MixedWorkspace::MixedWorkspace(MixedWorkspace&&) noexcept = default;
MixedWorkspace& MixedWorkspace::operator=(MixedWorkspace&&) noexcept = default;

namespace {

// [rad], by which bodies may turn before W is built anew: it says how far an impulse goes, not what it has to reach.
constexpr Real kKeepResponse = 0.05;

// Joints of any graph: by the factor of A.
class MixedStep final : public MixedStepBase {
public:
    using MixedStepBase::MixedStepBase;

    MixedStart begin();

private:
    void renew_joints() override;
    void apply(const std::vector<Real>& lambda) { ws_.rows.apply(lambda.data(), bodies_); }
    void predict_bias();
    Real solve_joints(const Real* bias, std::vector<Real>& sum);
    template <typename Projected, typename Free>
    void solve(const Real* bias, std::vector<Real>& sum, Projected projected_sweep, Free free_sweep);
    void follow_turn() override;
    bool first_solve() override;
    bool push() override;
    bool shake(std::vector<Real>* sum);
    void second_solve() override;

    bool is_projected_ = true;
};

MixedStart MixedStep::begin() {
    const MixedStart start = begin_rows();
    if (start != MixedStart::kReady) return start;
    renew_joints();
    is_projected_ = ws_.response.gather(ws_.rows, *plan_, contacts_, island_.contacts, bodies_, first(), island_.dynamic_end);
    turned_ = response_turned_ = std::numeric_limits<Real>::infinity();
    follow_turn();
    return MixedStart::kReady;
}

void MixedStep::renew_joints() {
    ws_.rows.build(joints_, island_.joints, bodies_);
    ws_.rows.assemble(*plan_, ws_.ldlt);
    ws_.ldlt.factor(settings_.drop);
    ++report_.factorisations;
    moved_ = 0;
}

// What the drift adds to the linear prediction of C: it changes little with the velocities, so it is taken once.
void MixedStep::predict_bias() {
    trial();
    errors();
    ws_.rows.velocities(bodies_, ws_.bias.data());
    for (int r = 0; r < rows_; ++r) ws_.bias[r] = (ws_.residual[r] - ws_.gap[r]) / h_ - ws_.bias[r];
}

// Makes G u = −bias; λ is added to `sum`. Returns the largest error met.
Real MixedStep::solve_joints(const Real* bias, std::vector<Real>& sum) {
    ws_.rows.velocities(bodies_, ws_.residual.data());
    Real largest = 0;
    for (int r = 0; r < rows_; ++r) {
        ws_.residual[r] = -(ws_.residual[r] + (bias ? bias[r] : 0));
        largest = std::max(largest, std::abs(ws_.residual[r]));
    }
    ws_.ldlt.solve(ws_.residual.data());
    ++report_.joint_solves;
    for (int r = 0; r < rows_; ++r) sum[r] += ws_.residual[r];
    apply(ws_.residual);
    return largest;
}

// Contacts and joints together: sweeps in the space where the joints hold, or joints and sweeps of free bodies in turns.
template <typename Projected, typename Free>
void MixedStep::solve(const Real* bias, std::vector<Real>& sum, Projected projected_sweep, Free free_sweep) {
    solve_joints(bias, sum);
    Real change = 0;
    if (is_projected_) ws_.response.begin(bodies_);
    for (int k = 0; k < settings_.sweeps; ++k) {
        change = is_projected_ ? projected_sweep() : std::max(free_sweep(), solve_joints(bias, sum));
        ++report_.si.contact_sweeps;
        if (change <= settings_.residual_tolerance) break;
    }
    if (is_projected_) {
        ws_.response.end(bodies_);
        solve_joints(bias, sum);
    }
    report_.si.residual = change;
}

bool MixedStep::first_solve() {
    kick(bodies_, first(), island_.dynamic_end, 0.5 * h_);
    warm_start_first(contacts_, island_.contacts, bodies_);
    apply(ws_.warm_first);
    ws_.first = ws_.warm_first;
    remember_start();
    drift_kinematic(bodies_, island_.dynamic_end, island_.body_end, h_);
    predict_bias();
    solve(
        ws_.bias.data(), ws_.first, [&] { return ws_.response.sweep_gaps(contacts_, island_.contacts, h_, 0); },
        [&] { return sweep_contact_gaps(contacts_, island_.contacts, bodies_, h_); });
    ws_.start_gap = ws_.target = ws_.gap;
    return shake(&ws_.first);
}

bool MixedStep::push() {
    hold_contacts(contacts_, island_.contacts, bodies_);
    if (probe_) probe_->note_solve(SolveTurn::kFirst, bodies_, contacts_, ws_.rows, ws_.first);
    begin_push(bodies_, first(), island_.dynamic_end);
    ws_.rows.velocities(bodies_, ws_.bias.data());
    for (int r = 0; r < rows_; ++r) ws_.bias[r] = -ws_.bias[r];
    if (is_projected_) {
        ws_.response.begin(bodies_);
        ws_.response.sweep_gaps(contacts_, island_.contacts, h_, settings_.contact_push);
        ws_.response.end(bodies_);
    } else {
        push_contacts(contacts_, island_.contacts, bodies_, h_, settings_.contact_push);
    }
    solve_joints(ws_.bias.data(), ws_.pushed);  // no push opens a joint
    set_target();
    const bool is_met = shake(nullptr);
    measure_push(bodies_, first(), island_.dynamic_end);
    return is_met;
}

// Corrections of the velocities until the trial pose meets the joints' target; λ is added to `sum`, if any.
bool MixedStep::shake(std::vector<Real>* sum) {
    Real last = std::numeric_limits<Real>::infinity();
    for (int k = 0;; ++k) {
        misses();
        Real largest = 0;
        for (int r = 0; r < rows_; ++r)
            if (!ws_.ldlt.is_dropped(r)) largest = std::max(largest, h_ * std::abs(ws_.residual[r]));
        if (largest <= settings_.tolerance * size_) return true;
        if (is_lost(k, largest, last)) return is_slack(largest);
        last = largest;
        ws_.ldlt.solve(ws_.residual.data());
        ++report_.joint_solves;
        for (int r = 0; sum && r < rows_; ++r) (*sum)[r] += ws_.residual[r];
        apply(ws_.residual);
    }
}

// Contact rows and W at the present poses, where they have changed enough.
void MixedStep::follow_turn() {
    if (!is_projected_ || turned_ <= admitted_lag(settings_.rebuild_angle, h_)) return;
    if (response_turned_ > kKeepResponse) {
        ws_.response.build(ws_.rows, *plan_, ws_.ldlt, bodies_);
        response_turned_ = 0;
    }
    ws_.response.build_rows(contacts_, island_.contacts);
    turned_ = 0;
}

void MixedStep::second_solve() {
    kick(bodies_, first(), island_.dynamic_end, 0.5 * h_);
    warm_start_second(contacts_, island_.contacts, bodies_);
    apply(ws_.warm_second);
    ws_.second = ws_.warm_second;
    solve(
        nullptr, ws_.second, [&] { return ws_.response.sweep_velocities(contacts_, island_.contacts); },
        [&] { return sweep_contact_velocities(contacts_, island_.contacts, bodies_); });
}

// kNotSo: the island is as it was.
template <typename Step>
MixedStart solve_with(MixedWorkspace::Data& workspace, SolverBodies& bodies, ContactPool& contacts, JointPool& joints,
                      const SiIsland& island, Real dt, const MixedSettings& settings, MixedReport& report, IslandProbe* probe) {
    for (int attempt = 0, parts = 1; attempt < settings.attempts; ++attempt, parts *= 2) {
        report.failure = MixedFailure::kNone;
        Step step(workspace, bodies, contacts, joints, island, dt / settings.substeps, settings, report, probe);
        if (probe) probe->begin(island, FrictionModel::kPyramid);
        const MixedStart start = step.begin();
        if (start != MixedStart::kReady) return start;
        if (attempt == 0) parts = step.parts_for_tension();
        step.cut(parts);
        scale_warm_start(contacts, island.contacts, 1.0 / parts);
        for (int k = 0; k < settings.substeps * parts && report.failure == MixedFailure::kNone; ++k)
            if (!step.substep()) report.failure = MixedFailure::kNoContraction;
        // Impulses that nothing foretold, as those of a first step, may ask for far more.
        const bool may_retry = report.failure == MixedFailure::kNone && attempt + 1 < settings.attempts;
        const int wanted = may_retry ? std::min(step.parts_for_tension() * parts, kMostMixedParts) : 0;
        if (wanted > 2 * parts) {
            parts = wanted / 2;
        } else if (report.failure == MixedFailure::kNone) {
            step.store(parts);
            scale_warm_start(contacts, island.contacts, parts);
            break;
        }
        workspace.saved.restore(bodies, contacts, island);
    }
    return MixedStart::kReady;
}

}  // namespace

int mixed_substeps(const SolverBodies& bodies, const SiIsland& island, Real dt, const MixedSettings& settings) {
    Real spin2 = 0;
    for (int i = island.body_begin; i < island.dynamic_end; ++i) spin2 = std::max(spin2, bodies.velocity[i].w.squaredNorm());
    const Real wanted = std::ceil(std::sqrt(spin2) * dt / settings.turn_per_substep);
    return wanted > settings.substeps ? static_cast<int>(std::min(wanted, static_cast<Real>(settings.max_substeps))) : settings.substeps;
}

MixedReport solve_island_mixed(MixedWorkspace& workspace, SolverBodies& bodies, ContactPool& contacts, JointPool& joints,
                               const SiIsland& island, Real dt, const MixedSettings& settings, IslandProbe* probe) {
    MixedReport report;
    MixedWorkspace::Data& data = workspace.data();
    data.saved.save(bodies, contacts, island);
    MixedStart start = solve_with<TreeStep>(data, bodies, contacts, joints, island, dt, settings, report, probe);
    if (start == MixedStart::kNotSo) start = solve_with<MixedStep>(data, bodies, contacts, joints, island, dt, settings, report, probe);
    if (start == MixedStart::kTooCostly) report.failure = MixedFailure::kTooCostly;
    return report;
}

}  // namespace cairn
