// What the stages of a solve by sequential impulses share; for solver/si.cpp (the default substep) and solver/si_textbook.cpp.
#pragma once

#include "solver/energy_gain.hpp"
#include "solver/island_probe.hpp"
#include "solver/si.hpp"

#include <algorithm>

namespace cairn {

// Everything a stage needs of its island.
struct SiContext {
    SolverBodies& bodies;
    ContactPool& contacts;
    JointPool& joints;
    const SiIsland& island;
    const SiSettings& settings;
    Real h;
    bool has_contacts;
    bool has_joints;
    bool has_spins;
    Softness joint_soft;
    SiReport report;
    WideContacts* wide = nullptr;  // takes the contacts' stages of the default substep, where that pays
    IslandProbe* probe = nullptr;
    const RowTargets* targets = nullptr;  // of the running substep, if it is the textbook's
    bool keeps_energy = false;            // solves of the default substep may not add energy (solver/energy_gain.hpp)
    EnergyGain gain = {};                 // of the running substep
};

// Sweeps joints and contacts, in the model's order, until no row changes its velocity by more than the tolerance or `most` sweeps are done.
// A sweep returns that change; the last one is reported.
template <typename JointSweep, typename ContactSweep>
void iterate(SiContext& c, int most, JointSweep joint_sweep, ContactSweep contact_sweep) {
    const bool contacts_first = c.has_contacts && c.settings.model.order == SweepOrder::kContactsFirst;
    Real residual = 0;
    for (int k = 0; k < most; ++k) {
        residual = 0;
        if (contacts_first) residual = contact_sweep();
        if (c.has_joints) {
            residual = std::max(residual, joint_sweep());
            ++c.report.joint_sweeps;
        }
        if (c.has_contacts) {
            if (!contacts_first) residual = std::max(residual, contact_sweep());
            ++c.report.contact_sweeps;
        }
        if (residual <= c.settings.residual_tolerance) break;
    }
    c.report.residual = residual;
}

// Drift, and rows at the new poses.
void move_bodies(SiContext& c);
void rebuild_rows(SiContext& c);
// The same with penetrations pushed back on top of the velocities, which are then as before, turned with the bodies.
void pushed_drift(SiContext& c);

// One substep by the textbook: velocities with the bias in them, then positions by these velocities (si_textbook.cpp).
void substep_textbook(SiContext& c);

}  // namespace cairn
