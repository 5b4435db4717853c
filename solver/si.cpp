#include "solver/bounce.hpp"
#include "solver/contact_kernel.hpp"
#include "solver/contact_models.hpp"
#include "solver/si_context.hpp"
#include "solver/spin_rows.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

bool is_default_substep(const SiSettings& settings) {
    return settings.stabilisation == SiStabilisation::kSplit && !settings.model.is_textbook();
}

void close_substep(SiContext& c) {
    if (c.has_joints) close_joint_substep(c.joints, c.island.joints);
    if (c.has_spins) close_spin_substep(c.contacts, c.island.spins);
    if (c.wide) return c.wide->close();
    if (c.has_contacts) close_contact_substep(c.contacts, c.island.contacts, FirstFriction::kHalf);
}

// f(begin, end) over the dynamic bodies, side by side where the contacts are. Returns the sum of what f returns.
template <class F>
std::uint64_t each_body(SiContext& c, F&& f) {
    return c.wide ? c.wide->each_body(f) : f(c.island.body_begin, c.island.dynamic_end);
}

void kick_bodies(SiContext& c, Real h) {
    each_body(c, [&](int begin, int end) {
        kick(c.bodies, begin, end, h);
        return 0;
    });
}

// For what follows to be told apart: a push, or what a solve gains.
void note_velocities(SiContext& c) {
    each_body(c, [&](int begin, int end) {
        begin_push(c.bodies, begin, end);
        return 0;
    });
}

EnergyGain measure_gain(SiContext& c) {
    each_body(c, [&](int begin, int end) {
        measure_gain(c.bodies, begin, end);
        return 0;
    });
    return gain_of(c.bodies, c.island.body_begin, c.island.dynamic_end);
}

// Joints are pulled back and kinematic bodies do work, which is energy that something gave; so does a bounce between the two solves.
bool must_keep_energy(const SiContext& c) {
    if (!is_default_substep(c.settings) || c.settings.may_gain || !c.has_contacts || c.has_joints || c.has_spins || c.island.has_bounce)
        return false;
    for (int i = c.island.dynamic_end; i < c.island.body_end; ++i)
        if (c.bodies.velocity[i].v != Vec3::Zero() || c.bodies.velocity[i].w != Vec3::Zero()) return false;
    return true;
}

// Tells the probe, if there is one, what a solve has left.
void note(SiContext& c, SolveTurn turn) {
    if (!c.probe) return;
    if (c.wide) c.wide->unpack_rows(c.contacts);
    c.probe->note_solve(turn, c.bodies, c.contacts, c.joints, c.targets);
    if (turn == SolveTurn::kSecond) c.probe->measure(c.bodies, c.contacts, c.contacts.impulse, c.joints);
}

int first_sweeps(const SiSettings& s) {
    constexpr int kMost = std::numeric_limits<int>::max();
    return s.iterations > kMost / s.first_solve ? kMost : s.iterations * s.first_solve;
}

// Kick, then velocities that the drift may use without any error growing.
void first_solve(SiContext& c) {
    kick_bodies(c, 0.5 * c.h);
    if (c.keeps_energy) note_velocities(c);
    if (c.has_joints) {
        warm_start_first(c.joints, c.island.joints, c.bodies);
        bias_joints(c.joints, c.island.joints, c.bodies, c.h, c.joint_soft.rate);
    }
    if (c.wide) {
        c.wide->start_first(c.h);
    } else if (c.has_contacts) {
        warm_start_first(c.contacts, c.island.contacts, c.bodies);
    }
    if (c.has_spins) warm_start_spins_first(c.contacts, c.island.spins, c.bodies);
    iterate(
        c, first_sweeps(c.settings), [&] { return sweep_joint_positions(c.joints, c.island.joints, c.bodies, c.joint_soft); },
        [&] { return c.wide ? c.wide->sweep_normals() : sweep_contact_gaps(c.contacts, c.island.contacts, c.bodies, c.h); });
}

// The pyramid is swept with the normals, a block at a time; other friction models after them.
Real sweep_velocities(SiContext& c) {
    if (c.wide) return c.wide->sweep_velocities();
    const SiModel& model = c.settings.model;
    const bool pyramid = model.friction == FrictionModel::kPyramid || model.friction == FrictionModel::kPyramidFixed;
    const Real change = sweep_contact_velocities(c.contacts, c.island.contacts, c.bodies, pyramid);
    const Real friction = pyramid ? 0 : sweep_frictions(c.contacts, c.island.contacts, c.bodies, model);
    const Real spin = c.has_spins ? sweep_spins(c.contacts, c.island.spins, c.bodies) : 0;
    return std::max({change, friction, spin});
}

Real sweep_on(SiContext& c) {
    ++c.report.contact_sweeps;
    return sweep_velocities(c);
}

// Where both solves together have gained energy because they did not converge: sweeps on, which takes it away if they do then; if they do
// not, takes back what is left to take from the second solve, and sweeps once more, since its friction has bounds of its own.
void take_gain_back(SiContext& c) {
    constexpr int kMostSweeps = 8;
    const Real tolerance = c.settings.residual_tolerance;
    EnergyGain gain = c.gain + measure_gain(c);
    for (int k = 0; k < kMostSweeps && gain.is_gain() && c.report.residual > tolerance; ++k) {
        c.report.residual = sweep_on(c);
        gain = c.gain + measure_gain(c);
    }
    if (!gain.is_gain() || c.report.residual <= tolerance) return;
    const Real share = lossless_share(c.bodies, c.island.body_begin, c.island.dynamic_end, c.gain.sum);
    keep_share(c.bodies, c.island.body_begin, c.island.dynamic_end, share);
    if (c.wide)
        c.wide->keep_impulse_share(share);
    else
        keep_impulse_share(c.contacts, c.island.contacts, share);
    c.report.residual = sweep_on(c);
}

void second_solve(SiContext& c) {
    kick_bodies(c, 0.5 * c.h);
    if (c.keeps_energy) note_velocities(c);
    if (c.has_joints) warm_start_second(c.joints, c.island.joints, c.bodies);
    if (c.wide) {
        c.wide->start_second();
    } else if (c.has_contacts) {
        warm_start_second(c.contacts, c.island.contacts, c.bodies);
    }
    if (c.has_spins) warm_start_spins_second(c.contacts, c.island.spins, c.bodies);
    iterate(
        c, c.settings.iterations, [&] { return sweep_joint_velocities(c.joints, c.island.joints, c.bodies); },
        [&] { return sweep_velocities(c); });
    if (c.keeps_energy) take_gain_back(c);
    note(c, SolveTurn::kSecond);
}

// Which sign a zero has may depend on what shares a batch: all get the same.
void unsign_zeros(SiContext& c) {
    each_body(c, [&](int begin, int end) {
        for (int i = begin; i < end; ++i) {
            c.bodies.velocity[i].v.array() += 0.0;
            c.bodies.velocity[i].w.array() += 0.0;
        }
        return 0;
    });
}

void substep_split(SiContext& c) {
    if (c.probe) c.probe->begin_substep(c.bodies, c.h);
    if (c.island.has_bounce)
        predict_bounces(c.contacts, c.island.contacts, c.bodies, c.h, c.settings.model.friction != FrictionModel::kPyramidFixed);
    first_solve(c);
    pushed_drift(c);
    second_solve(c);
}

}  // namespace

void move_bodies(SiContext& c) {
    c.report.rotor_calls += each_body(c, [&](int begin, int end) { return drift(c.bodies, begin, end, c.h); });
    drift_kinematic(c.bodies, c.island.dynamic_end, c.island.body_end, c.h);
}

void rebuild_rows(SiContext& c) {
    if (c.has_joints) build_joints(c.joints, c.island.joints, c.bodies);
    if (c.wide) {
        each_body(c, [&](int begin, int end) {
            c.wide->copy_poses(c.bodies, begin, end);
            return 0;
        });
        c.wide->copy_poses(c.bodies, c.island.dynamic_end, c.island.body_end);
        c.wide->advance(c.h, admitted_lag(c.settings.rebuild_angle, c.h));
    } else if (c.has_contacts) {
        advance_blocks(c.contacts, c.island.contacts, c.bodies, c.h, admitted_lag(c.settings.rebuild_angle, c.h));
    }
    if (c.has_spins) build_spins(c.contacts, c.island.spins, c.bodies);
}

void pushed_drift(SiContext& c) {
    const bool narrow = c.has_contacts && !c.wide;
    if (c.has_joints) hold_joints(c.joints, c.island.joints);
    if (c.wide) c.wide->hold(c.h, c.settings.contact_push);
    if (narrow) hold_contacts(c.contacts, c.island.contacts, c.bodies);
    if (c.has_spins) hold_spins(c.contacts, c.island.spins, c.bodies);
    note(c, c.targets ? SolveTurn::kOnly : SolveTurn::kFirst);
    if (c.keeps_energy) c.gain = measure_gain(c);
    note_velocities(c);
    if (c.wide) c.wide->push();
    if (narrow) push_contacts(c.contacts, c.island.contacts, c.bodies, c.h, c.settings.contact_push);
    each_body(c, [&](int begin, int end) {
        measure_push(c.bodies, begin, end);
        return 0;
    });
    move_bodies(c);
    rebuild_rows(c);
    if (narrow) release_contacts(c.contacts, c.island.contacts);
    each_body(c, [&](int begin, int end) {
        end_push(c.bodies, begin, end);
        return 0;
    });
    if (c.probe) c.probe->note_drift(c.bodies, true);
}

void SiReport::add(const SiReport& r) {
    contact_sweeps += r.contact_sweeps;
    joint_sweeps += r.joint_sweeps;
    rotor_calls += r.rotor_calls;
    residual = std::max(residual, r.residual);
    natural_residual = std::max(natural_residual, r.natural_residual);
}

bool may_go_wide(const SiIsland& island, const SiSettings& settings) {
    const FrictionModel friction = settings.model.friction;
    return island.contacts.begin < island.contacts.end && !island.has_bounce && !island.has_spins() && is_default_substep(settings) &&
           friction != FrictionModel::kCone && friction != FrictionModel::kOneDirection;
}

bool plan_wide(WideContacts& wide, const ContactPool& contacts, const SiIsland& island, const SiSettings& settings,
               const SolverBodies* bodies, Team* team) {
    return may_go_wide(island, settings) && wide.plan(contacts, island.contacts, island.body_begin, island.dynamic_end, bodies, team);
}

SiReport solve_island_si(SolverBodies& bodies, ContactPool& contacts, JointPool& joints, const SiIsland& island, Real dt,
                         const SiSettings& settings, WideContacts* wide, IslandProbe* probe) {
    SiContext c{bodies,
                contacts,
                joints,
                island,
                settings,
                dt / settings.substeps,
                island.contacts.begin < island.contacts.end,
                !island.joints.empty(),
                island.has_spins(),
                make_softness(settings.joint_h_omega, settings.joint_damping),
                {}};
    // A joint alone is solved by one sweep and may be rigid; joints that have to agree with others by sweeps may not.
    if (!c.has_contacts && island.joints.count() == 1) c.joint_soft = {};
    bodies.push.resize(bodies.velocity.size());
    bodies.gain.resize(bodies.velocity.size());
    if (c.has_spins) build_spins(contacts, island.spins, bodies);
    c.wide = wide;
    c.probe = probe;
    c.keeps_energy = must_keep_energy(c);
    for (int k = 0; k < settings.substeps; ++k) {
        if (!settings.model.warm_start) {
            scale_warm_start(contacts, island.contacts, 0);
            scale_warm_spins(contacts, island.spins, 0);
            if (c.wide) c.wide->forget_warm_start();
            scale_warm_start(joints, island.joints, 0);
        }
        if (is_default_substep(settings)) {
            substep_split(c);
        } else {
            substep_textbook(c);
        }
        close_substep(c);
    }
    if (c.wide) unsign_zeros(c);
    return c.report;
}

}  // namespace cairn
