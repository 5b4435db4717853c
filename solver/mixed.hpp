// Joints solved directly inside the substep, contacts by sweeps around them: islands that have both.
//
// A substep has the form of sequential impulses' (solver/si.hpp), with the joints as in RATTLE (solver/rattle.hpp). h = dt / substeps:
//     kick h/2 with the external forces and the impulses that this solve ended with in the last substep
//     first solve: contacts so that no gap closes beyond zero over the drift, joints so that C(q₁) = C(q₀), in turns
//     push: on top of it, for the drift alone, penetrations taken back and joints that are apart brought together
//     drift h
//     kick h/2 likewise, on the rows at the new poses
//     second solve: contacts G v = 0 (or a bounce) with friction, joints G v = 0, in turns
// A turn of the joints is one solve with A = G M⁻¹ Gᵀ, factored without fill where joints make a tree (solver/block_ldlt.hpp):
//     λ = −A⁻¹ (G u + b),  u ← u + M⁻¹ Gᵀ λ
// so all joints of the island are met together, whatever hangs from them; in the first solve b is what the drift along the present
// velocities adds to the linear prediction, (C(q₀ ⊕ h u) − C(q₀)) / h − G u, in the second it is 0. Turns are block Gauss-Seidel between
// all joints on one side and single contacts on the other: each lowers the same quadratic, so they converge. The joints have the last word
// in both solves: what few turns leave is left in contacts, and the sweeps of the next substep take it up from their warm impulses. At the
// end of the push SHAKE's iteration (Ryckaert, Ciccotti and Berendsen 1977) on the same factor meets the joints at the end pose, so their
// error does not depend on how many sweeps the contacts got. What it moves leaves no velocity. Sources: Andersen 1983 (RATTLE); Baraff 1996
// (joints eliminated in linear time inside a solve of contacts); the composition is ours.
// Where joints make a forest all of it is done in the coordinates that they leave free (solver/joint_tree.hpp, solver/mixed_tree.hpp): the
// same equations, without A. Loops, joints that are apart, and contacts too far from their roots take the factor.
#pragma once

#include "solver/si.hpp"

#include <memory>

namespace cairn {

struct MixedSettings {
    int substeps = 1;  // at least
    int max_substeps = 8;
    Real turn_per_substep = 0.25;     // [rad], by which a body turns at most where max_substeps allow it
    int sweeps = 4;                  // most of a solve
    Real residual_tolerance = 1e-4;  // [m/s], of a row, at which a solve ends
    Real tolerance = 1e-5;           // what SHAKE may leave of a joint's error, relative to the largest arm
    int max_corrections = 4;         // of SHAKE
    Real slack = 1e-3;               // what it may leave when these are used up; beyond, the step is done again with twice the substeps
    int attempts = 6;                // at a step, each in more parts
    Real closing_speed = 1;          // [m/s], at most, with which joints that are apart come together
    Real contact_push = 0.4;         // share of a penetration that a substep takes back
    Real rebuild_angle = 1e-3;       // [rad], as SiSettings
    Real drop = 1e-12;               // relative pivot below which a row counts as redundant
    Real max_flops = 5e6;            // of one factorisation: beyond it the island is left to others
};

enum class MixedFailure : std::uint8_t { kNone, kTooCostly, kNoContraction };

struct MixedReport {
    MixedFailure failure = MixedFailure::kNone;  // with any other the island is as it was
    std::uint64_t factorisations = 0;
    std::uint64_t joint_solves = 0;
    SiReport si;  // sweeps of contacts, rotor calls, residual
};

// Memory that steps share. Nothing in it shows in a result. One a thread.
class MixedWorkspace {
public:
    struct Data;
    MixedWorkspace();
    ~MixedWorkspace();
    MixedWorkspace(MixedWorkspace&&) noexcept;
    MixedWorkspace& operator=(MixedWorkspace&&) noexcept;
    Data& data() { return *data_; }

private:
    std::unique_ptr<Data> data_;
};

// Substeps for the island's present spin.
int mixed_substeps(const SolverBodies& bodies, const SiIsland& island, Real dt, const MixedSettings& settings);

// Steps an island with joints and contacts by dt in `settings.substeps`, or more where SHAKE asks for them. Contact rows must be built and
// warm impulses set (those of dt / settings.substeps, as which they are left); totals are filled. Joint rows need not be built. Allocates
// nothing once it has seen the island's graph.
MixedReport solve_island_mixed(MixedWorkspace& workspace, SolverBodies& bodies, ContactPool& contacts, JointPool& joints,
                               const SiIsland& island, Real dt, const MixedSettings& settings, IslandProbe* probe = nullptr);

}  // namespace cairn
