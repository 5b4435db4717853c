#include "solver/island_probe.hpp"
#include "solver/rattle_rate.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

constexpr Real kOuter = 0.41449077179437573714;  // 1 / (4 − 4^{1/3})
// Rows and factor serve on while bodies have moved by less than this, relative to the largest arm.
constexpr Real kKeep = 1e-11;
constexpr Real kStage[5] = {kOuter, kOuter, 1 - 4 * kOuter, kOuter, kOuter};

const ContactPool kNoContacts;

class Integrator {
public:
    Integrator(RattleWorkspace& workspace, SolverBodies& bodies, JointPool& joints, const SiIsland& island, const RattleSettings& settings,
               RattleReport& report)
        : ws_(workspace), bodies_(bodies), joints_(joints), island_(island), settings_(settings), report_(report) {}

    // False: too costly.
    bool begin();
    // Everything up to the first stage: gaps, factor, velocities, warm impulses.
    void prepare(Real dt, bool warm);
    bool run(Real dt, const RattleCut& cut, Real rate);
    JointMotion motion_now();
    Real size() const { return size_; }
    void store();
    // What prepare() has done, and how well the joints hold.
    void note_start(IslandProbe& probe) const;
    void note_end(IslandProbe& probe);
    void save();
    void restore();
    bool is_finite_state() const;

private:
    int first() const { return island_.body_begin; }
    BodyMotion& motion(int i) { return bodies_.motion[i]; }
    void measure();
    void factor();
    Real gap();
    void close_gaps(Real dt);
    void move_poses(Real share);
    void kick(Real h) { cairn::kick(bodies_, island_.body_begin, island_.dynamic_end, h); }
    void remember_start();
    void trial(Real h);
    bool dropped_rows_hold(Real h) const;
    bool shake(Real h);
    Real broyden_step(int k);
    void finish_drift(Real h);
    void project(Real h);
    bool stage(Real h);

    RattleWorkspace& ws_;
    SolverBodies& bodies_;
    JointPool& joints_;
    const SiIsland& island_;
    const RattleSettings& settings_;
    RattleReport& report_;
    const JointPlan* plan_ = nullptr;
    int rows_ = 0;
    int dropped_ = 0;      // by the present factor
    Real size_ = 0;        // [m], largest arm
    Real rounding_ = 0;    // [m], of a position
    Real min_mass_ = 0;    // [kg]
    Real moved_ = 0;       // [m], by the bodies in the last drift beside each other, summed, at most
    Real tolerance_ = 0;   // [m], of SHAKE
    Real previous_h_ = 0;  // [s], of the stage that left ws_.previous
};

bool Integrator::begin() {
    plan_ = &ws_.plans.find(joints_, island_.joints, bodies_, first(), settings_.max_flops);
    if (plan_->is_too_costly) return false;
    ws_.rows.gather(joints_, island_.joints, bodies_, *plan_);
    rows_ = plan_->pattern.rows();
    const std::size_t bodies = island_.body_end - island_.body_begin, rows = rows_;
    ws_.start.resize(bodies);
    ws_.stiffness.resize(bodies);
    for (std::vector<Real>* v : {&ws_.lambda, &ws_.previous, &ws_.slope, &ws_.total, &ws_.target, &ws_.residual, &ws_.scratch})
        v->resize(rows);
    ws_.steps.resize(rows * (settings_.max_iterations + 1));
    ws_.images.resize(rows * (settings_.max_iterations + 1));
    ws_.norms.resize(settings_.max_iterations + 1);
    measure();
    save();
    return true;
}

// Lengths and masses that tolerances refer to.
void Integrator::measure() {
    Real far = 0, inv_mass = 0;
    for (int i = first(); i < island_.dynamic_end; ++i) {
        far = std::max(far, motion(i).x.cwiseAbs().maxCoeff());
        inv_mass = std::max(inv_mass, motion(i).inv_mass);
    }
    size_ = largest_arm(joints_, island_.joints, bodies_);
    rounding_ = 4 * std::numeric_limits<Real>::epsilon() * far;
    min_mass_ = 1 / inv_mass;
}

void Integrator::save() {
    ws_.saved_motion.assign(bodies_.motion.begin() + first(), bodies_.motion.begin() + island_.body_end);
    ws_.saved_velocity.assign(bodies_.velocity.begin() + first(), bodies_.velocity.begin() + island_.body_end);
}

void Integrator::restore() {
    std::copy(ws_.saved_motion.begin(), ws_.saved_motion.end(), bodies_.motion.begin() + first());
    std::copy(ws_.saved_velocity.begin(), ws_.saved_velocity.end(), bodies_.velocity.begin() + first());
}

void Integrator::factor() {
    ws_.rows.build(joints_, island_.joints, bodies_);
    ws_.rows.assemble(*plan_, ws_.ldlt);
    dropped_ = ws_.ldlt.factor(settings_.drop);
    report_.dropped_rows = std::max(report_.dropped_rows, dropped_);
    ++report_.factorisations;
}

// C into `residual`; its largest entry.
Real Integrator::gap() {
    ws_.rows.errors(joints_, island_.joints, bodies_, ws_.residual.data());
    Real largest = 0;
    for (int r = 0; r < rows_; ++r) largest = std::max(largest, std::abs(ws_.residual[r]));
    return largest;
}

void Integrator::prepare(Real dt, bool warm) {
    const Real share = warm ? 1 : 0;
    for_each_listed_joint(joints_, island_.joints, [&](auto kind, const auto& j, int i) {
        constexpr int N = joint_rows(decltype(kind)::value);
        const int row = ws_.rows.list()[i].first;
        Eigen::Map<VecN<N>>(&ws_.previous[row]) = share * 2 / settings_.warm_step * j.warm_second;
        Eigen::Map<VecN<N>>(&ws_.slope[row]) = share * 3 / (settings_.warm_step * settings_.warm_step) * (j.warm_first - j.warm_second);
    });
    previous_h_ = settings_.warm_step;
    std::fill(ws_.total.begin(), ws_.total.end(), 0.0);
    factor();
    close_gaps(dt);
    // Velocities that somebody has set need not agree with the joints.
    ws_.rows.velocities(bodies_, ws_.residual.data());
    for (int r = 0; r < rows_; ++r) ws_.residual[r] = -ws_.residual[r];
    ws_.ldlt.solve(ws_.residual.data());
    ws_.rows.apply(ws_.residual.data(), bodies_);
    for (int r = 0; r < rows_; ++r) ws_.total[r] += ws_.residual[r];
}

void Integrator::close_gaps(Real dt) {
    report_.gap = gap();
    Real left = report_.gap;
    const Real small = 10 * (settings_.tolerance * size_ + rounding_);  // SHAKE's own
    for (int k = 0; k < 3 && left > small; ++k) {
        // Displacements are made in the place of velocities, which are those that were saved.
        for (int i = first(); i < island_.dynamic_end; ++i) bodies_.velocity[i] = {};
        for (int r = 0; r < rows_; ++r) ws_.residual[r] = -ws_.residual[r];
        ws_.ldlt.solve(ws_.residual.data());
        ws_.rows.apply(ws_.residual.data(), bodies_);
        Real farthest = 0;
        for (int i = first(); i < island_.dynamic_end; ++i)
            farthest = std::max({farthest, bodies_.velocity[i].v.norm(), size_ * bodies_.velocity[i].w.norm()});
        const Real most = settings_.closing_speed * dt;
        move_poses(farthest > most ? most / farthest : 1);
        for (int i = first(); i < island_.body_end; ++i) bodies_.velocity[i] = ws_.saved_velocity[i - first()];
        factor();
        left = gap();
        if (farthest > most) break;
    }
    for (int r = 0; r < rows_; ++r) ws_.target[r] = left > small ? ws_.residual[r] : 0;
}

void Integrator::move_poses(Real share) {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        BodyMotion& m = motion(i);
        const BodyVelocity& d = bodies_.velocity[i];
        m.x += share * d.v;
        m.q = exp_rotation(share * d.w) * m.q;
        m.q.normalize();
        m.R = m.q.toRotationMatrix();
        m.inv_inertia_W = m.R * m.inv_inertia_B * m.R.transpose();
    }
}

JointMotion Integrator::motion_now() {
    for (int r = 0; r < rows_; ++r) ws_.scratch[r] = ws_.previous[r] + previous_h_ / 3 * ws_.slope[r];
    return joint_motion(bodies_, joints_, island_, ws_.rows, ws_.scratch.data(), size_, ws_.stiffness);
}

void Integrator::remember_start() {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        RattleWorkspace::Start& s = ws_.start[i - first()];
        const BodyMotion& m = motion(i);
        s.x = m.x;
        s.q = m.q;
        s.R = m.R;
    }
}

// Poses at the end of a drift by the present velocities.
void Integrator::trial(Real h) {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        RattleWorkspace::Start& s = ws_.start[i - first()];
        BodyMotion& m = motion(i);
        const BodyVelocity& u = bodies_.velocity[i];
        m.x = s.x + h * u.v;
        m.q = s.q;
        s.w_end = u.w;
        if (u.w.isZero(0)) {
            m.R = s.R;
            continue;
        }
        rotate_free(m.q, s.w_end, m.rotor, h, 1);
        m.R = m.q.toRotationMatrix();
        report_.rotor_calls += m.rotor.kind != InertiaKind::kSpherical;
    }
}

// The k-th correction of λ into `steps`, from −A⁻¹ residual in `scratch`. Returns the squared M-norm of the velocities that it changes.
Real Integrator::broyden_step(int k) {
    Real *z = &ws_.steps[k * rows_], *Az = &ws_.images[k * rows_];
    for (int r = 0; r < rows_; ++r) {
        z[r] = ws_.scratch[r];
        Az[r] = ws_.ldlt.is_dropped(r) ? 0 : -ws_.residual[r];
    }
    const auto product = [&](const Real* a, const Real* b) {
        Real sum = 0;
        for (int r = 0; r < rows_; ++r) sum += a[r] * b[r];
        return sum;
    };
    for (int j = 0; j < k; ++j) {
        const Real c = product(&ws_.images[j * rows_], z) / ws_.norms[j];
        if (j + 1 < k) {
            const Real *s = &ws_.steps[(j + 1) * rows_], *y = &ws_.images[(j + 1) * rows_];
            for (int r = 0; r < rows_; ++r) {
                z[r] += c * s[r];
                Az[r] += c * y[r];
            }
        } else if (c < 0.9) {  // else the update would be nearly singular
            for (int r = 0; r < rows_; ++r) {
                z[r] /= 1 - c;
                Az[r] /= 1 - c;
            }
        }
    }
    return ws_.norms[k] = product(Az, z);
}

// Whether rows that the factor dropped are met by the others, at the last residual; else they were not redundant.
bool Integrator::dropped_rows_hold(Real h) const {
    if (dropped_ == 0) return true;
    const Real most = settings_.slack * size_ + report_.gap;
    for (int r = 0; r < rows_; ++r)
        if (ws_.ldlt.is_dropped(r) && !(std::abs(h * ws_.residual[r]) <= most)) return false;
    return true;
}

bool Integrator::shake(Real h) {
    Real last = 0;
    for (int k = 0; k <= settings_.max_iterations; ++k) {
        trial(h);
        if (k == settings_.max_iterations) break;
        ws_.rows.errors(joints_, island_.joints, bodies_, ws_.residual.data());
        for (int r = 0; r < rows_; ++r) {
            ws_.residual[r] = (ws_.residual[r] - ws_.target[r]) / h;
            ws_.scratch[r] = -ws_.residual[r];
        }
        ws_.ldlt.solve(ws_.scratch.data());
        const Real norm2 = broyden_step(k);
        ++report_.iterations;
        const Real* step = &ws_.steps[k * rows_];
        for (int r = 0; r < rows_; ++r) ws_.lambda[r] += step[r];
        ws_.rows.apply(step, bodies_);
        const Real moved = std::abs(h) * std::sqrt(std::max(norm2, 0.0) / min_mass_);
        if (!(moved < std::numeric_limits<Real>::max())) return false;
        const Real contraction = k > 0 && last > 0 ? moved / last : 1;
        last = moved;
        // What the next correction would be, if it shrank as this one did.
        if (moved * std::min(contraction, 1.0) <= tolerance_) {
            trial(h);
            return dropped_rows_hold(h);
        }
        if (k >= 2 && contraction > 1 && moved > size_) return false;
    }
    return last <= 1e3 * tolerance_;
}

void Integrator::finish_drift(Real h) {
    moved_ = 0;
    // Rows do not change where all fly together.
    const Vec3 common = common_velocity(bodies_, island_, ws_.rows);
    for (int i = first(); i < island_.dynamic_end; ++i) {
        BodyMotion& m = motion(i);
        bodies_.velocity[i].w = ws_.start[i - first()].w_end;
        moved_ += std::abs(h) * ((bodies_.velocity[i].v - common).cwiseAbs().sum() + size_ * bodies_.velocity[i].w.cwiseAbs().sum());
        if (m.rotor.kind != InertiaKind::kSpherical) m.inv_inertia_W = m.R * m.inv_inertia_B * m.R.transpose();
    }
}

void Integrator::project(Real h) {
    ws_.rows.velocities(bodies_, ws_.residual.data());
    for (int r = 0; r < rows_; ++r) ws_.residual[r] = -ws_.residual[r];
    ws_.ldlt.solve(ws_.residual.data());
    ws_.rows.apply(ws_.residual.data(), bodies_);
    for (int r = 0; r < rows_; ++r) {
        ws_.total[r] += ws_.residual[r];
        ws_.previous[r] = 2 / h * ws_.residual[r];
    }
    previous_h_ = h;
}

bool Integrator::stage(Real h) {
    for (int r = 0; r < rows_; ++r)
        ws_.lambda[r] = ws_.ldlt.is_dropped(r) ? 0 : h / 2 * (ws_.previous[r] + (h + previous_h_) / 3 * ws_.slope[r]);
    kick(0.5 * h);
    remember_start();
    drift_kinematic(bodies_, island_.dynamic_end, island_.body_end, h);
    ws_.rows.apply(ws_.lambda.data(), bodies_);
    if (!shake(h)) return false;
    const bool same_way = (h > 0) == (previous_h_ > 0);
    for (int r = 0; r < rows_; ++r) {
        ws_.total[r] += ws_.lambda[r];
        // Stages of opposite sign nearly cancel in h + previous_h: their slope would be noise.
        if (same_way) ws_.slope[r] = 3 * (2 / h * ws_.lambda[r] - ws_.previous[r]) / (h + previous_h_);
    }
    finish_drift(h);
    kick(0.5 * h);
    if (moved_ > kKeep * size_) factor();
    project(h);
    return true;
}

bool Integrator::run(Real dt, const RattleCut& cut, Real rate) {
    const Real h = dt / cut.substeps;
    // What SHAKE leaves falls with the step's own error, h⁵.
    const Real turn = std::min(rate * h / 0.15, 1.0);
    tolerance_ = std::max(settings_.tolerance * turn * turn * turn * turn * turn, 1e-14) * size_ + rounding_;
    for (int k = 0; k < cut.substeps; ++k)
        for (int s = 0; s < cut.stages; ++s)
            if (!stage(cut.stages == 1 ? h : kStage[s] * h)) return false;
    return true;
}

bool Integrator::is_finite_state() const {
    for (int i = first(); i < island_.dynamic_end; ++i) {
        const BodyMotion& m = bodies_.motion[i];
        const BodyVelocity& u = bodies_.velocity[i];
        if (!(is_finite(m.x) && is_finite(m.q) && is_finite(u.v) && is_finite(u.w))) return false;
    }
    return true;
}

void Integrator::store() {
    const Real h = settings_.warm_step;
    for_each_listed_joint(joints_, island_.joints, [&](auto kind, auto& j, int i) {
        constexpr int N = joint_rows(decltype(kind)::value);
        const int row = ws_.rows.list()[i].first;
        const VecN<N> slope = Eigen::Map<const VecN<N>>(&ws_.slope[row]);
        const VecN<N> force = Eigen::Map<const VecN<N>>(&ws_.previous[row]) + previous_h_ / 3 * slope;
        j.warm_first = h / 2 * (force + h / 3 * slope);
        j.warm_second = h / 2 * (force - h / 3 * slope);
        j.total = Eigen::Map<const VecN<N>>(&ws_.total[row]);
    });
}

void Integrator::note_start(IslandProbe& probe) const {
    probe.note_solve(SolveTurn::kOnly, bodies_, kNoContacts, ws_.rows, ws_.total);
    for (int i = first(); i < island_.dynamic_end; ++i) probe.note_moved(ws_.saved_motion[i - first()], bodies_.motion[i]);
}

void Integrator::note_end(IslandProbe& probe) {
    build_joints(joints_, island_.joints, bodies_);
    probe.measure(bodies_, kNoContacts, kNoContacts.impulse, joints_);
}

}  // namespace

const char* to_string(RattleFailure failure) {
    constexpr const char* names[] = {"none", "has contacts", "too costly", "no contraction", "not finite"};
    return names[static_cast<int>(failure)];
}

RattleReport solve_island_rattle(RattleWorkspace& workspace, SolverBodies& bodies, JointPool& joints, const SiIsland& island, Real dt,
                                 const RattleSettings& settings, IslandProbe* probe) {
    RattleReport report;
    if (island.contacts.begin < island.contacts.end) {
        report.failure = RattleFailure::kHasContacts;
        return report;
    }
    Integrator integrator(workspace, bodies, joints, island, settings, report);
    if (!integrator.begin()) {
        report.failure = RattleFailure::kTooCostly;
        return report;
    }
    RattleCut cut;
    constexpr int kAttempts = 4;
    bool warm = true;  // impulses of a step with an impact in it, or with contacts that are gone, foretell nothing: then again without them
    for (int attempt = 1; attempt <= kAttempts && cut.substeps <= std::max(settings.max_substeps, settings.substeps); ++attempt) {
        if (probe) {
            probe->begin(island, FrictionModel::kNone);
            probe->begin_substep(bodies, dt);
        }
        integrator.prepare(dt, warm);
        if (probe) integrator.note_start(*probe);
        const JointMotion start = integrator.motion_now();
        if (const RattleCut wanted = choose_cut(start, dt, integrator.size(), settings); wanted.total() > cut.total()) cut = wanted;
        const JointEnergy before = joint_energy(bodies, island);
        report.rate = start.rate;
        report.substeps = cut.substeps;
        report.stages = cut.stages;
        report.failure = RattleFailure::kNone;
        if (!integrator.run(dt, cut, start.rate)) {
            report.failure = RattleFailure::kNoContraction;
            cut.substeps *= 2;
            warm = false;
        } else if (!integrator.is_finite_state()) {
            report.failure = RattleFailure::kNotFinite;
            cut.substeps *= 2;
            warm = false;
        } else {
            const RattleCut wanted = choose_cut(integrator.motion_now(), dt, integrator.size(), settings);
            // A whip that comes and goes within the step shows in its energy.
            const JointEnergy after = joint_energy(bodies, island);
            const Real lost = before.is_kept ? std::abs(after.total - before.total) : 0;
            const Real admitted =
                settings.energy_slack * std::max(before.kinetic, after.kinetic) + settings.tolerance * before.weight * integrator.size();
            const bool exact = settings.substeps > 0 || lost <= admitted;
            if ((exact && wanted.total() <= 2 * cut.total()) || attempt == kAttempts) {
                integrator.store();
                if (probe) integrator.note_end(*probe);
                return report;
            }
            if (exact) {
                cut = wanted;
            } else {
                cut.substeps *= 2;
            }
        }
        integrator.restore();
    }
    return report;
}

}  // namespace cairn
