#include "solver/si.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Everything a stage of the solve needs of its island.
struct Context {
    SolverBodies& bodies;
    ContactPool& contacts;
    JointPool& joints;
    const SiIsland& island;
    const SiSettings& settings;
    Real h;
    bool has_contacts;
    bool has_joints;
    Softness joint_soft;
    SiReport report;
};

// Sweeps joints, then contacts, until no row changes its velocity by more than the tolerance or `most` sweeps are done.
template <typename JointSweep, typename ContactSweep>
void iterate(Context& c, int most, JointSweep joint_sweep, ContactSweep contact_sweep) {
    for (int k = 0; k < most; ++k) {
        Real residual = 0;
        if (c.has_joints) {
            residual = joint_sweep();
            ++c.report.joint_sweeps;
        }
        if (c.has_contacts) {
            residual = std::max(residual, contact_sweep());
            ++c.report.contact_sweeps;
        }
        c.report.residual = residual;
        if (residual <= c.settings.residual_tolerance) return;
    }
}

void move_bodies(Context& c) {
    c.report.rotor_calls += drift(c.bodies, c.island.body_begin, c.island.dynamic_end, c.h);
    drift_kinematic(c.bodies, c.island.dynamic_end, c.island.body_end, c.h);
}

void close_substep(Context& c) {
    if (c.has_joints) close_joint_substep(c.joints, c.island.joints);
    if (c.has_contacts) close_contact_substep(c.contacts, c.island.contacts);
}

// Kick, then velocities that the drift may use without any error growing.
void first_solve(Context& c) {
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, 0.5 * c.h);
    if (c.has_joints) {
        warm_start_first(c.joints, c.island.joints, c.bodies);
        bias_joints(c.joints, c.island.joints, c.bodies, c.h, c.joint_soft.rate);
    }
    if (c.has_contacts) warm_start_first(c.contacts, c.island.contacts, c.bodies);
    iterate(
        c, c.settings.iterations, [&] { return sweep_joint_positions(c.joints, c.island.joints, c.bodies, c.joint_soft); },
        [&] { return sweep_contact_gaps(c.contacts, c.island.contacts, c.bodies, c.h); });
}

// Drift with the push on top of the velocities; the velocities are then as before, turned with the bodies.
void pushed_drift(Context& c) {
    const int begin = c.island.body_begin, end = c.island.dynamic_end;
    for (int i = begin; i < end; ++i) c.bodies.push[i] = c.bodies.velocity[i];
    if (c.has_joints) hold_joints(c.joints, c.island.joints);
    if (c.has_contacts) {
        hold_contacts(c.contacts, c.island.contacts);
        push_contacts(c.contacts, c.island.contacts, c.bodies, c.h, c.settings.contact_push);
    }
    for (int i = begin; i < end; ++i) {
        BodyVelocity &push = c.bodies.push[i], &u = c.bodies.velocity[i];
        push = {u.v - push.v, u.w - push.w};
    }
    move_bodies(c);
    if (c.has_joints) build_joints(c.joints, c.island.joints, c.bodies);
    if (c.has_contacts) {
        advance_blocks(c.contacts, c.island.contacts, c.bodies, c.h, c.settings.rebuild_angle);
        release_contacts(c.contacts, c.island.contacts);
    }
    for (int i = begin; i < end; ++i) {
        c.bodies.velocity[i].v -= c.bodies.push[i].v;
        c.bodies.velocity[i].w -= c.bodies.push[i].w;
    }
}

void second_solve(Context& c) {
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, 0.5 * c.h);
    if (c.has_joints) warm_start_second(c.joints, c.island.joints, c.bodies);
    if (c.has_contacts) warm_start_second(c.contacts, c.island.contacts, c.bodies);
    iterate(
        c, c.settings.iterations, [&] { return sweep_joint_velocities(c.joints, c.island.joints, c.bodies); },
        [&] { return sweep_contact_velocities(c.contacts, c.island.contacts, c.bodies); });
}

void substep_split(Context& c) {
    if (c.island.has_bounce) predict_bounces(c.contacts, c.island.contacts, c.bodies, c.h);
    first_solve(c);
    pushed_drift(c);
    second_solve(c);
    close_substep(c);
}

// The textbook: velocities with the bias in them, then positions by these velocities.
void substep_target_velocity(Context& c) {
    const BlockRange range = c.island.contacts;
    const Real beta = c.settings.stabilisation == SiStabilisation::kNone ? 0 : c.settings.baumgarte;
    if (c.island.has_bounce) predict_bounces(c.contacts, range, c.bodies, c.h);
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, c.h);
    if (c.has_joints) {
        bias_joints_baumgarte(c.joints, c.island.joints, c.bodies, c.h, beta);
        warm_start_all(c.joints, c.island.joints, c.bodies);
    }
    if (c.has_contacts) warm_start_all(c.contacts, range, c.bodies);
    iterate(
        c, c.settings.iterations, [&] { return sweep_joint_positions(c.joints, c.island.joints, c.bodies, {}); },
        [&] { return sweep_contact_target_velocity(c.contacts, range, c.bodies, c.h, beta); });
    move_bodies(c);
    if (c.has_joints) build_joints(c.joints, c.island.joints, c.bodies);
    if (c.has_contacts) advance_blocks(c.contacts, range, c.bodies, c.h, c.settings.rebuild_angle);
    close_substep(c);
}

}  // namespace

void SiReport::add(const SiReport& r) {
    contact_sweeps += r.contact_sweeps;
    joint_sweeps += r.joint_sweeps;
    rotor_calls += r.rotor_calls;
    residual = std::max(residual, r.residual);
}

SiReport solve_island_si(SolverBodies& bodies, ContactPool& contacts, JointPool& joints, const SiIsland& island, Real dt,
                         const SiSettings& settings) {
    Context c{bodies,
              contacts,
              joints,
              island,
              settings,
              dt / settings.substeps,
              island.contacts.begin < island.contacts.end,
              !island.joints.empty(),
              make_softness(settings.joint_h_omega, settings.joint_damping),
              {}};
    // A joint alone is solved by one sweep and may be rigid; joints that have to agree with others by sweeps may not.
    if (!c.has_contacts && island.joints.count() == 1) c.joint_soft = {};
    bodies.push.resize(bodies.velocity.size());
    for (int k = 0; k < settings.substeps; ++k) {
        if (settings.stabilisation == SiStabilisation::kSplit) {
            substep_split(c);
        } else {
            substep_target_velocity(c);
        }
    }
    return c.report;
}

}  // namespace cairn
