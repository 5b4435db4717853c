// Sequential impulses (Catto 2005; projected Gauss-Seidel with accumulated, clamped impulses), in substeps.
//
// The default, kSplit, is a substep of the RATTLE form (Andersen 1983) with unilateral rows, h = dt / substeps:
//     kick h/2 with the external forces and the impulses that this solve ended with in the last substep
//     first solve: velocities for which no gap closes beyond zero over the drift; joints are brought back, softly
//     push: on top of them, for the drift alone, velocities that take penetrations back (split impulses)
//     drift h
//     kick h/2 likewise, on the rows at the new poses
//     second solve: G v = 0 (or a bounce), friction; λ >= 0 holds for the sum of both solves
// The textbook's substep (si_textbook.cpp) takes every other stabilisation, and every model that SiModel::is_textbook() names: kick h, one
// solve with the bias in it, drift h. There kSplit stands for the push alone, on top of that one solve.
//
// Where the solves converge, the default is of 2nd order and exact under constant forces; a push leaves no velocity and no warm impulse
// behind.
#pragma once

#include "solver/contact_rows.hpp"
#include "solver/joint_rows.hpp"
#include "solver/si_model.hpp"
#include "solver/wide_contacts.hpp"

namespace cairn {

class IslandProbe;

using SiStabilisation = Stabilisation;

struct SiSettings {
    int substeps = 4;
    int iterations = 2;              // most sweeps of a solve
    int first_solve = 1;             // times as many in the first solve of a substep
    Real residual_tolerance = 1e-4;  // [m/s]; 0: `iterations` sweeps, fewer only after one that changed nothing (residual exactly 0)
    SiStabilisation stabilisation = SiStabilisation::kSplit;
    Real contact_push = 0.25;               // share of a penetration that a substep takes back
    Real joint_h_omega = 2 * kPi * 0.25;    // soft joints: 2π f h
    Real joint_damping = 0.5;               // ζ
    Real baumgarte = 0.2;                   // β of kTargetVelocity, and of joints in all of the textbook but kNone
    Real contact_h_omega = 2 * kPi * 0.25;  // kSoft: 2π f h of penetrating contacts
    Real contact_damping = 5;               // ζ
    Real contact_max_push = 3;              // [m/s]
    SiModel model;
    bool may_gain = false;      // energy, by solves that do not converge (solver/energy_gain.hpp)
    Real rebuild_angle = 1e-3;  // [rad]: rows are rebuilt once a body has turned by more since they were; less in short substeps
};

// The parts of the pools that belong to one island: its dynamic bodies, then its own copies of the kinematic bodies that it touches.
struct SiIsland {
    int body_begin = 0;
    int dynamic_end = 0;
    int body_end = 0;
    BlockRange contacts;
    BlockRange spins;  // torsional and rolling friction of its contacts
    JointRanges joints;
    bool has_bounce = false;  // a row with restitution
    bool has_spins() const { return spins.begin < spins.end; }
};

struct SiReport {
    std::uint64_t contact_sweeps = 0;
    std::uint64_t joint_sweeps = 0;
    std::uint64_t rotor_calls = 0;
    Real residual = 0;          // [m/s], largest velocity change of a row in the last sweep
    Real natural_residual = 0;  // [m/s], contact_residual() after the last solve; textbook substeps alone
    void add(const SiReport& r);
};

// Whether an island's contacts may go four blocks at a time: the default substep with its friction, without bounces.
bool may_go_wide(const SiIsland& island, const SiSettings& settings);

// Whether they do: enough of them are side by side. Plans them if so; with a team and the bodies, shared out where that pays.
bool plan_wide(WideContacts& wide, const ContactPool& contacts, const SiIsland& island, const SiSettings& settings,
               const SolverBodies* bodies = nullptr, Team* team = nullptr);

// Steps one island by dt. Warm impulses must be set (those of one substep); totals are filled. Rows must be built, totals be 0, but for
// contacts that `wide` has planned: they need normals and first tangents only (contact_rows.hpp), and the same impulses stay in `wide`
// (result, unpack). `probe`, if any, is told what the solves do.
SiReport solve_island_si(SolverBodies& bodies, ContactPool& contacts, JointPool& joints, const SiIsland& island, Real dt,
                         const SiSettings& settings, WideContacts* wide = nullptr, IslandProbe* probe = nullptr);

}  // namespace cairn
