#include "solver/mixed.hpp"

#include "solver/bounce.hpp"
#include "solver/contact_kernel.hpp"
#include "solver/island_probe.hpp"
#include "solver/mixed_response.hpp"
#include "solver/rattle_rate.hpp"

#include <algorithm>
#include <limits>

namespace cairn {

namespace {

// What a step changes of an island before it is known to succeed.
struct SavedIsland {
    std::vector<BodyMotion> motion;
    std::vector<BodyVelocity> velocity;
    std::vector<WarmImpulse> warm;

    void save(const SolverBodies& bodies, const ContactPool& contacts, const SiIsland& island) {
        const PointRange p = points_of(contacts, island.contacts);
        motion.assign(bodies.motion.begin() + island.body_begin, bodies.motion.begin() + island.body_end);
        velocity.assign(bodies.velocity.begin() + island.body_begin, bodies.velocity.begin() + island.body_end);
        warm.assign(contacts.warm.begin() + p.begin, contacts.warm.begin() + p.end);
    }

    void restore(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island) const {
        const PointRange p = points_of(contacts, island.contacts);
        std::copy(motion.begin(), motion.end(), bodies.motion.begin() + island.body_begin);
        std::copy(velocity.begin(), velocity.end(), bodies.velocity.begin() + island.body_begin);
        std::copy(warm.begin(), warm.end(), contacts.warm.begin() + p.begin);
        std::fill(contacts.impulse.begin() + p.begin, contacts.impulse.begin() + p.end, PointImpulse{});
        std::fill(contacts.total.begin() + p.begin, contacts.total.begin() + p.end, PointImpulse{});
        for (int k = island.contacts.begin; k < island.contacts.end; ++k) build_block(contacts, contacts.blocks[k], bodies);
    }
};

}  // namespace

struct MixedWorkspace::Data {
    struct Start {
        Vec3 x;
        Quat q;
        Vec3 w_end;  // after the drift
    };
    JointPlans plans;
    JointRowList rows;
    BlockLdlt ldlt;
    ContactResponse response;
    SavedIsland saved;
    std::vector<Start> start;                                                     // by body of the island
    std::vector<Real> warm_first, warm_second, first, second, total;              // impulses, size rows
    std::vector<Real> gap, start_gap, target, bias, residual, pushed, stiffness;  // size rows
};

MixedWorkspace::MixedWorkspace() : data_(std::make_unique<Data>()) {}
MixedWorkspace::~MixedWorkspace() = default;
MixedWorkspace::MixedWorkspace(MixedWorkspace&&) noexcept = default;
MixedWorkspace& MixedWorkspace::operator=(MixedWorkspace&&) noexcept = default;

namespace {

using Workspace = MixedWorkspace::Data;

// Rows and factor serve on while bodies have moved by less than this, relative to the largest arm.
constexpr Real kKeep = 1e-7;
// [rad], by which the fastest mode of a taut chain may turn in a substep (solver/rattle.hpp), and the most parts that this cuts one into.
constexpr Real kTurnPerSubstep = 0.7;
constexpr int kMostParts = 64;
// [rad], by which bodies may turn before W is built anew: it says how far an impulse goes, not what it has to reach.
constexpr Real kKeepResponse = 0.05;

class MixedStep {
public:
    MixedStep(Workspace& workspace, SolverBodies& bodies, ContactPool& contacts, JointPool& joints, const SiIsland& island, Real h,
              const MixedSettings& settings, MixedReport& report, IslandProbe* probe)
        : ws_(workspace),
          bodies_(bodies),
          contacts_(contacts),
          joints_(joints),
          island_(island),
          settings_(settings),
          report_(report),
          probe_(probe),
          h_(h) {}

    // False: too costly.
    bool begin();
    // Into how many parts the substep is to be cut for what tension makes of it: a power of two.
    int parts_for_tension();
    void cut(int parts);
    bool substep();  // false: SHAKE does not contract
    void store(Real warm_scale);

private:
    int first() const { return island_.body_begin; }
    void factor();
    void errors() { ws_.rows.errors(joints_, island_.joints, bodies_, ws_.residual.data()); }
    void set_target();
    void remember_start();
    void trial();
    void apply(const std::vector<Real>& lambda) { ws_.rows.apply(lambda.data(), bodies_); }
    void predict_bias();
    Real solve_joints(const Real* bias, std::vector<Real>& sum);
    template <typename Projected, typename Free>
    void solve(const Real* bias, std::vector<Real>& sum, Projected projected_sweep, Free free_sweep);
    void follow_turn();
    bool first_solve();
    bool push();
    bool shake(std::vector<Real>* sum);
    void finish_drift();
    void second_solve();
    void note_second();

    Workspace& ws_;
    SolverBodies& bodies_;
    ContactPool& contacts_;
    JointPool& joints_;
    const SiIsland& island_;
    const MixedSettings& settings_;
    MixedReport& report_;
    IslandProbe* probe_;
    const JointPlan* plan_ = nullptr;
    Real h_;
    int rows_ = 0;
    Real size_ = 1;                          // [m], largest arm
    Real moved_ = 0;                         // [m], by the bodies since the rows were built, summed, at most
    Real turned_ = 0, response_turned_ = 0;  // [rad], at most, since the contact rows, W were built
    bool is_projected_ = true;
};

bool MixedStep::begin() {
    plan_ = &ws_.plans.find(joints_, island_.joints, bodies_, first(), settings_.max_flops);
    if (plan_->is_too_costly) return false;
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
    factor();
    is_projected_ = ws_.response.gather(ws_.rows, *plan_, contacts_, island_.contacts, bodies_, first(), island_.dynamic_end);
    turned_ = response_turned_ = std::numeric_limits<Real>::infinity();
    follow_turn();
    errors();
    ws_.gap = ws_.residual;
    return true;
}

int MixedStep::parts_for_tension() {
    for (int r = 0; r < rows_; ++r) ws_.residual[r] = (ws_.warm_first[r] + ws_.warm_second[r]) / h_;
    ws_.stiffness.resize(island_.dynamic_end - first());
    const Real rate = joint_motion(bodies_, joints_, island_, ws_.rows, ws_.residual.data(), size_, ws_.stiffness).tension;
    int parts = 1;
    while (parts < kMostParts && rate * h_ > kTurnPerSubstep * parts) parts *= 2;
    return parts;
}

void MixedStep::cut(int parts) {
    h_ /= parts;
    for (int r = 0; r < rows_; ++r) {
        ws_.warm_first[r] /= parts;
        ws_.warm_second[r] /= parts;
    }
}

void MixedStep::factor() {
    ws_.rows.build(joints_, island_.joints, bodies_);
    ws_.rows.assemble(*plan_, ws_.ldlt);
    ws_.ldlt.factor(settings_.drop);
    ++report_.factorisations;
    moved_ = 0;
}

// Where the joints are to be at the end of the drift: together, or nearer by what the closing speed allows.
void MixedStep::set_target() {
    Real largest = 0;
    for (int r = 0; r < rows_; ++r) largest = std::max(largest, std::abs(ws_.start_gap[r]));
    const Real most = settings_.closing_speed * h_, left = largest > most ? 1 - most / largest : 0;
    for (int r = 0; r < rows_; ++r) ws_.target[r] = left * ws_.start_gap[r];
}

void MixedStep::remember_start() {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        const BodyMotion& m = bodies_.motion[i];
        ws_.start[i - first()] = {m.x, m.q, Vec3::Zero()};
    }
}

// Poses at the end of a drift by the present velocities.
void MixedStep::trial() {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        Workspace::Start& s = ws_.start[i - first()];
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
    const Real tolerance = settings_.tolerance * size_;
    Real last = std::numeric_limits<Real>::infinity();
    for (int k = 0;; ++k) {
        trial();
        errors();
        Real largest = 0, start = 0;
        for (int r = 0; r < rows_; ++r) {
            start = std::max(start, std::abs(ws_.start_gap[r]));
            ws_.gap[r] = ws_.residual[r];
            ws_.residual[r] = (ws_.target[r] - ws_.residual[r]) / h_;
            if (!ws_.ldlt.is_dropped(r)) largest = std::max(largest, h_ * std::abs(ws_.residual[r]));
        }
        if (largest <= tolerance) return true;
        if (k == settings_.max_corrections || !(largest < 2 * last)) return largest <= settings_.slack * size_ + start;
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

void MixedStep::finish_drift() {
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

void MixedStep::second_solve() {
    kick(bodies_, first(), island_.dynamic_end, 0.5 * h_);
    warm_start_second(contacts_, island_.contacts, bodies_);
    apply(ws_.warm_second);
    ws_.second = ws_.warm_second;
    solve(
        nullptr, ws_.second, [&] { return ws_.response.sweep_velocities(contacts_, island_.contacts); },
        [&] { return sweep_contact_velocities(contacts_, island_.contacts, bodies_); });
}

void MixedStep::note_second() {
    for (int r = 0; r < rows_; ++r) ws_.residual[r] = ws_.first[r] + ws_.second[r];
    probe_->note_solve(SolveTurn::kSecond, bodies_, contacts_, ws_.rows, ws_.residual);
    build_joints(joints_, island_.joints, bodies_);
    probe_->measure(bodies_, contacts_, contacts_.impulse, joints_);
}

bool MixedStep::substep() {
    if (probe_) probe_->begin_substep(bodies_, h_);
    if (island_.has_bounce) {
        predict_bounces(contacts_, island_.contacts, bodies_, h_, true);
        turned_ = std::numeric_limits<Real>::infinity();  // rows are built along the normals of the impacts
        follow_turn();
    }
    if (!first_solve() || !push()) return false;
    finish_drift();
    if (moved_ > kKeep * size_) factor();
    advance_blocks(contacts_, island_.contacts, bodies_, h_, admitted_lag(settings_.rebuild_angle, h_));
    follow_turn();
    release_contacts(contacts_, island_.contacts);
    end_push(bodies_, first(), island_.dynamic_end);
    if (probe_) probe_->note_drift(bodies_, true);
    second_solve();
    if (probe_) note_second();
    close_contact_substep(contacts_, island_.contacts, FirstFriction::kHalf);
    for (int r = 0; r < rows_; ++r) ws_.total[r] += ws_.first[r] + ws_.second[r];
    std::swap(ws_.warm_first, ws_.first);
    std::swap(ws_.warm_second, ws_.second);
    return true;
}

void MixedStep::store(Real warm_scale) {
    for_each_listed_joint(joints_, island_.joints, [&](auto kind, auto& j, int i) {
        constexpr int N = joint_rows(decltype(kind)::value);
        const int row = ws_.rows.list()[i].first;
        j.warm_first = warm_scale * Eigen::Map<const VecN<N>>(&ws_.warm_first[row]);
        j.warm_second = warm_scale * Eigen::Map<const VecN<N>>(&ws_.warm_second[row]);
        j.total = Eigen::Map<const VecN<N>>(&ws_.total[row]);
    });
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
    SavedIsland& saved = workspace.data().saved;
    saved.save(bodies, contacts, island);
    for (int attempt = 0, parts = 1; attempt < settings.attempts; ++attempt, parts *= 2) {
        report.failure = MixedFailure::kNone;
        MixedStep step(workspace.data(), bodies, contacts, joints, island, dt / settings.substeps, settings, report, probe);
        if (probe) probe->begin(island, FrictionModel::kPyramid);
        if (!step.begin()) {
            report.failure = MixedFailure::kTooCostly;
            return report;
        }
        if (attempt == 0) parts = step.parts_for_tension();
        step.cut(parts);
        scale_warm_start(contacts, island.contacts, 1.0 / parts);
        for (int k = 0; k < settings.substeps * parts && report.failure == MixedFailure::kNone; ++k)
            if (!step.substep()) report.failure = MixedFailure::kNoContraction;
        // Impulses that nothing foretold, as those of a first step, may ask for far more.
        const bool may_retry = report.failure == MixedFailure::kNone && attempt + 1 < settings.attempts;
        const int wanted = may_retry ? std::min(step.parts_for_tension() * parts, kMostParts) : 0;
        if (wanted > 2 * parts) {
            parts = wanted / 2;
        } else if (report.failure == MixedFailure::kNone) {
            step.store(parts);
            scale_warm_start(contacts, island.contacts, parts);
            break;
        }
        saved.restore(bodies, contacts, island);
    }
    return report;
}

}  // namespace cairn
