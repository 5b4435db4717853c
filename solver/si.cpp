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
    bool measure;
    SiReport report;
};

// Sweeps joints, then contacts, until no row changes its velocity by more than the tolerance or the maximum is reached.
template <typename JointSweep, typename ContactSweep>
void iterate(Context& c, JointSweep joint_sweep, ContactSweep contact_sweep) {
    for (int k = 0; k < c.settings.iterations; ++k) {
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
        if (c.measure && residual <= c.settings.residual_tolerance) return;
    }
}

void kick_half(Context& c) {
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, 0.5 * c.h);
}

void move_bodies(Context& c) {
    c.report.rotor_calls += drift(c.bodies, c.island.body_begin, c.island.dynamic_end, c.h);
    drift_kinematic(c.bodies, c.island.dynamic_end, c.island.body_end, c.h);
}

void close_substep(Context& c) {
    if (c.has_joints) close_joint_substep(c.joints, c.island.joints);
    if (c.has_contacts) close_contact_substep(c.contacts, c.island.contacts);
}

// A joint alone is solved by one sweep and may be rigid; joints that have to agree with others by sweeps may not.
Softness joint_softness(const Context& c) {
    if (!c.has_contacts && c.island.joints.count() == 1) return {};
    return make_softness(c.settings.joint_h_omega, c.settings.joint_damping);
}

void substep_soft(Context& c) {
    const BlockRange range = c.island.contacts;
    if (c.island.has_bounce) predict_bounces(c.contacts, range, c.bodies, c.h);
    kick_half(c);
    if (c.has_joints) warm_start_positions(c.joints, c.island.joints, c.bodies);
    if (c.has_contacts) warm_start_positions(c.contacts, range, c.bodies);
    const Softness joint_soft = joint_softness(c);
    if (c.has_joints) bias_joints(c.joints, c.island.joints, c.bodies, c.h, joint_soft.rate);
    iterate(
        c, [&] { return sweep_joint_positions(c.joints, c.island.joints, c.bodies, joint_soft, c.measure); },
        [&] { return sweep_contact_positions(c.contacts, range, c.bodies, c.h, c.measure); });
    move_bodies(c);
    if (c.has_joints) build_joints(c.joints, c.island.joints, c.bodies);
    if (c.has_contacts) advance_blocks(c.contacts, range, c.bodies, c.h, c.settings.rebuild_angle);
    kick_half(c);
    if (c.has_joints) warm_start_velocities(c.joints, c.island.joints, c.bodies);
    if (c.has_contacts) warm_start_velocities(c.contacts, range, c.bodies);
    iterate(
        c, [&] { return sweep_joint_velocities(c.joints, c.island.joints, c.bodies, c.measure); },
        [&] { return sweep_contact_velocities(c.contacts, range, c.bodies, c.measure); });
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
        c, [&] { return sweep_joint_positions(c.joints, c.island.joints, c.bodies, Softness{}, c.measure); },
        [&] { return sweep_contact_target_velocity(c.contacts, range, c.bodies, c.h, beta, c.measure); });
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
              island.contacts.begin<island.contacts.end, !island.joints.empty(), settings.residual_tolerance> 0,
              {}};
    for (int k = 0; k < settings.substeps; ++k) {
        if (settings.stabilisation == SiStabilisation::kSoft) {
            substep_soft(c);
        } else {
            substep_target_velocity(c);
        }
    }
    return c.report;
}

}  // namespace cairn
