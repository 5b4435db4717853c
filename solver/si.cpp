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

// Half of the external impulse and half of what the rows gave in the last substep.
void half_kick(Context& c) {
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, 0.5 * c.h);
    if (c.has_joints) warm_start_joints(c.joints, c.island.joints, c.bodies, 0.5);
    if (c.has_contacts) warm_start_contacts(c.contacts, c.island.contacts, c.bodies, 0.5);
}

void move_bodies(Context& c) {
    c.report.rotor_calls += drift(c.bodies, c.island.body_begin, c.island.dynamic_end, c.h);
    drift_kinematic(c.bodies, c.island.dynamic_end, c.island.body_end, c.h);
}

void close_substep(Context& c) {
    if (c.has_joints) close_joint_substep(c.joints, c.island.joints);
    for (int k = c.island.contacts.begin; k < c.island.contacts.end; ++k) {
        const ContactBlock& block = c.contacts.blocks[k];
        for (int p = block.first; p < block.first + block.count; ++p) {
            PointImpulse &impulse = c.contacts.impulse[p], &total = c.contacts.total[p];
            total.normal += impulse.normal;
            total.friction[0] += impulse.friction[0];
            total.friction[1] += impulse.friction[1];
            c.contacts.warm[p] = impulse;
            impulse = {};
        }
    }
}

void substep_soft(Context& c) {
    const BlockRange range = c.island.contacts;
    if (c.island.has_bounce) predict_bounces(c.contacts, range, c.bodies, c.h);
    half_kick(c);
    if (c.has_joints) bias_joints(c.joints, c.island.joints, c.bodies, c.h, c.settings.joint_rate);
    iterate(
        c, [&] { return sweep_joints(c.joints, c.island.joints, c.bodies, true, c.measure); },
        [&] { return sweep_contact_positions(c.contacts, range, c.bodies, c.h, c.measure); });
    move_bodies(c);
    if (c.has_joints) build_joints(c.joints, c.island.joints, c.bodies);
    if (c.has_contacts) advance_blocks(c.contacts, range, c.bodies, c.h, c.settings.rebuild_angle);
    half_kick(c);
    iterate(
        c, [&] { return sweep_joints(c.joints, c.island.joints, c.bodies, false, c.measure); },
        [&] { return sweep_contact_velocities(c.contacts, range, c.bodies, c.h, c.measure); });
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
        warm_start_joints(c.joints, c.island.joints, c.bodies, 1);
    }
    if (c.has_contacts) warm_start_contacts(c.contacts, range, c.bodies, 1);
    iterate(
        c, [&] { return sweep_joints(c.joints, c.island.joints, c.bodies, true, c.measure); },
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
