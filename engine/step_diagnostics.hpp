// What a step can tell about itself: how well its rows are solved, who solved what and why, how far joints and contacts are off, and where
// the energy went. Measured only with WorldSettings::diagnostics; then it takes a pass over the rows a solve, and changes no result.
// The measures do not depend on the number of threads. Allocates only where a step has more islands than any before it.
#pragma once

#include "engine/joint.hpp"
#include "engine/settings.hpp"
#include "solver/measures.hpp"

#include <cstdint>
#include <vector>

namespace cairn {

// Why an island went to its solver.
enum class SolverReason : std::uint8_t {
    kForced,             // WorldSettings::solver names it
    kModel,              // a model or a stabilisation is asked for that sequential impulses alone have
    kJointsAlone,        // nothing touches: RATTLE
    kContactsAlone,      // no joint, no bounce, small or hardly moving: direct
    kJointsAndContacts,  // mixed
    kBounces,            // contacts with restitution: sequential impulses
    kSpinFriction,       // torsional or rolling friction: sequential impulses
    kLarge,              // more moving bodies than the direct solver takes, or of like masses
    kLoneMover,          // one body that moves: sequential impulses solve it as well
    kWaits,              // the direct solver has not converged lately, or contacts come and go in what moves: it waits
    kSpent,              // the direct solver has spent what the island may cost
    kStands,  // a step has left all of it as it was, and so does this one: the direct solver's impulses still hold (standing.cpp)
};
constexpr int kSolverReasons = 12;

// Natural-map residual ‖x − proj(x − r w)‖ / r of a row: x its impulse, w its velocity less what it aims at, r its effective mass. [m/s]
// Of the solve that ends each substep: normal rows aim at no approach (or at their bounce), friction rows at no slip within ±μ λ_N, joint
// rows at no opening; the textbook's one solve at its bias, too. Rows of angles count with the radius of gyration of their two bodies.
struct StepResidual {
    Real max = 0;  // [m/s]
    Real rms = 0;  // [m/s], over all rows of all substeps
    std::uint64_t rows = 0;
    RowKind worst = RowKind::kNone;  // of the largest: its kind,
    BodyId body_a;                   // its bodies (the world, for a joint with it)
    BodyId body_b;
    JointId joint;  // and its joint, if it is one's
};

struct IslandReport {
    BodyId first_body;  // the lowest of them
    std::uint32_t bodies = 0;
    std::uint32_t joints = 0;
    std::uint32_t contacts = 0;  // points
    std::uint32_t rows = 0;
    SolverChoice solver = SolverChoice::kSi;  // that solved it, or (is_refused) was forced on it in vain
    SolverReason reason = SolverReason::kForced;
    SolverChoice fell_back_from = SolverChoice::kAuto;  // chosen first, but did not converge; kAuto: none
    bool is_refused = false;
    int substeps = 0;              // before a solver cuts them further
    std::uint64_t iterations = 0;  // sweeps (si, mixed), Newton steps (direct; none where it rests), SHAKE's corrections (rattle)
    StepResidual residual;
};

// The change of energy over a step [J], by cause. Gravity to remainder add up to kinetic_change; without gravity, whose work is what the
// potential loses, to total_change(). Exactly so, since the remainder is what is left.
struct StepEnergy {
    Real kinetic_change = 0;
    Real potential_change = 0;  // −Σ m g·Δx over the dynamic bodies

    Real gravity = 0;  // −potential_change
    Real applied = 0;  // Σ F·Δx + τ·θ of the bodies' own constant forces and torques; θ: rotation vector of the step
    // Work of impulses: Δλ of a row times its velocity, taken midway of what it does to it (solver/island_probe.hpp). That of contacts is
    // taken in the relative motion of the two bodies, so it is loss or gain whoever looks.
    Real driven = 0;    // by kinematic bodies, through what touches or joins them (not in islands of joints alone: remainder)
    Real impacts = 0;   // of normal rows: lost in impacts, given back by restitution; nothing where bodies rest
    Real friction = 0;  // of friction rows
    // Of joint rows: nothing where they hold; what is lost where they pass on an impact, or velocities did not agree with them; what it
    // takes to pull together by velocities. In islands of joints alone of the velocities at the start of the step only.
    Real joints = 0;
    // What position correction puts in: moving bodies against gravity and forces by no velocity of theirs, and the bias that target
    // velocities and soft contacts make.
    Real stabilisation = 0;
    Real sleep = 0;      // taken from bodies that were put to sleep
    Real remainder = 0;  // what is left: the error of the integration (rotations, and the textbook's kicks), and rounding

    Real total_change() const { return kinetic_change + potential_change; }
};

struct StepDiagnostics {
    StepResidual residual;              // over all islands
    std::vector<IslandReport> islands;  // that were solved in this step, in their order
    // At the end of the step, over all joints.
    Real joint_error = 0;  // [m], largest separation of anchors (off the axis of a slider, off the length of a rod),
    JointId joint_error_at;
    Real joint_angle = 0;  // [rad], largest misalignment
    JointId joint_angle_at;
    // At its start, as StepReport::max_penetration.
    Real penetration = 0;  // [m], deepest point
    BodyId penetration_a;
    BodyId penetration_b;
    StepEnergy energy;
};

const char* to_string(RowKind kind);
// For people: what follows "because".
const char* to_string(SolverReason reason);

}  // namespace cairn
