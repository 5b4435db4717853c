// The substep of the textbook, with every model of solver/si_model.hpp.
#include "solver/bounce.hpp"
#include "solver/contact_models.hpp"
#include "solver/reference_methods.hpp"
#include "solver/residual.hpp"
#include "solver/si_context.hpp"
#include "solver/spin_rows.hpp"

namespace cairn {
namespace {

RowTargets targets_of(const SiContext& c) {
    const SiSettings& s = c.settings;
    RowTargets targets;
    targets.h = c.h;
    if (s.stabilisation == SiStabilisation::kTargetVelocity) targets.beta = s.baumgarte;
    if (s.stabilisation == SiStabilisation::kSoft) {
        targets.soft = make_softness(s.contact_h_omega, s.contact_damping);
        targets.beta = targets.soft.rate;
        targets.push = s.contact_max_push;
    }
    return targets;
}

// Sweeps until it is converged or has swept enough: normal impulses before tangential ones in each sweep.
void solve(SiContext& c, const RowTargets& targets) {
    const SiModel& model = c.settings.model;
    const BlockRange range = c.island.contacts;
    // The directions are of contact rows; joints and moments would break them.
    const bool accelerated = model.method == SweepMethod::kNncg && c.has_contacts && !c.has_joints && !c.has_spins;
    int sweeps = 0;
    Real gradient = 0;
    if (accelerated) nncg_begin(c.contacts, range);
    iterate(
        c, c.settings.iterations, [&] { return sweep_joint_positions(c.joints, c.island.joints, c.bodies, {}); },
        [&] {
            const bool is_last = ++sweeps == c.settings.iterations;
            const Real normals = sweep_normals(c.contacts, range, c.bodies, model, targets);
            const Real frictions = sweep_frictions(c.contacts, range, c.bodies, model);
            const Real spins = c.has_spins ? sweep_spins(c.contacts, c.island.spins, c.bodies) : 0;
            const Real change = std::max({normals, frictions, spins});
            // Nothing follows that would project λ back on its bounds.
            if (accelerated && !is_last && change > c.settings.residual_tolerance) nncg_carry_on(c.contacts, range, c.bodies, gradient);
            return change;
        });
    if (!c.has_contacts) return;
    ResidualMeasure residual;
    add_contact_residual(c.contacts, range, c.contacts.impulse, c.bodies, model.friction, &targets, residual);
    c.report.natural_residual = residual.max;
}

// The work of a solve; of the one that ends the substep, also the residuals.
void note(SiContext& c, const RowTargets& targets, bool is_last) {
    if (!c.probe) return;
    c.probe->note_solve(SolveTurn::kOnly, c.bodies, c.contacts, c.joints, &targets);
    if (is_last) c.probe->measure(c.bodies, c.contacts, c.contacts.impulse, c.joints, &targets);
}

}  // namespace

void substep_textbook(SiContext& c) {
    const RowTargets targets = targets_of(c);
    const SiStabilisation stabilisation = c.settings.stabilisation;
    c.targets = &targets;
    if (c.probe) c.probe->begin_substep(c.bodies, c.h);
    if (c.island.has_bounce)
        predict_bounces(c.contacts, c.island.contacts, c.bodies, c.h, c.settings.model.friction != FrictionModel::kPyramidFixed);
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, c.h);
    if (c.has_joints) {
        const Real beta = stabilisation == SiStabilisation::kNone ? 0 : c.settings.baumgarte;
        bias_joints_baumgarte(c.joints, c.island.joints, c.bodies, c.h, beta);
        warm_start_all(c.joints, c.island.joints, c.bodies);
    }
    if (c.has_contacts) warm_start_all(c.contacts, c.island.contacts, c.bodies);
    if (c.has_spins) warm_start_spins_all(c.contacts, c.island.spins, c.bodies);
    solve(c, targets);
    note(c, targets, stabilisation != SiStabilisation::kSoft);
    if (stabilisation == SiStabilisation::kSplit) {
        pushed_drift(c);
    } else {
        move_bodies(c);
        rebuild_rows(c);
        if (c.probe) c.probe->note_drift(c.bodies, false);
    }
    if (stabilisation != SiStabilisation::kSoft) return;
    // The springs' velocity has done its work; what is left must not close gaps.
    RowTargets rigid;
    rigid.h = c.h;
    if (c.has_joints) bias_joints_baumgarte(c.joints, c.island.joints, c.bodies, c.h, 0);
    solve(c, rigid);
    note(c, rigid, true);
}

}  // namespace cairn
