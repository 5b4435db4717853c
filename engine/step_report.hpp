// What a step did. Filled by World::step; counters are of this step alone.
#pragma once

#include "engine/settings.hpp"
#include "engine/step_diagnostics.hpp"
#include "engine/step_profile.hpp"

#include <cstdint>

namespace cairn {

struct StepReport {
    bool ok = true;                     // false: a body went non-finite (it is put back to its last finite pose and disabled), a bad dt, or
                                        // an island that the forced solver refused
    std::uint32_t bodies_disabled = 0;  // of this step
    std::uint32_t pairs = 0;            // overlapping fat boxes
    std::uint32_t manifolds = 0;        // with at least one point
    std::uint32_t contacts = 0;         // manifold points
    std::uint32_t manifolds_reused = 0;  // answered without asking the narrow phase
    std::uint64_t narrow_queries = 0;
    std::uint64_t fcl_calls = 0;
    std::uint64_t fcl_failures = 0;
    std::uint32_t normal_rows = 0;
    std::uint32_t friction_rows = 0;
    std::uint32_t joint_rows = 0;
    std::uint32_t islands = 0;                      // with a constraint, solved in this step
    std::uint32_t islands_of[kSolverChoices] = {};  // of them, by the solver that solved them (index: SolverChoice)
    std::uint32_t islands_refused = 0;              // left where they are: the forced solver cannot take them
    std::uint32_t refused_body = UINT32_MAX;        // lowest body of such an island, in order of creation
    std::uint32_t free_bodies = 0;                  // moved exactly, without a solver
    std::uint32_t sleeping_bodies = 0;
    std::uint64_t rotor_calls = 0;     // free-rigid-body rotations of bodies with unequal moments
    std::uint64_t joint_sweeps = 0;    // passes over joint rows
    std::uint64_t contact_sweeps = 0;  // passes over contact rows
    std::uint64_t factorisations = 0;  // of the direct solver
    Real max_penetration = 0;          // [m], deepest point at the start of the step of what does not sleep
    Real residual = 0;                 // [m/s], largest velocity change of a row in the last sweep of any solve
    Real natural_residual = 0;         // [m/s], of the contacts of islands solved by the textbook's substep (solver/contact_models.hpp)
    // With WorldSettings::tolerance alone:
    std::uint32_t error_estimates = 0;             // made in this step
    std::uint32_t steps_refined = 0;               // islands and bodies that were stepped again, finer, since their estimate was too large
    std::uint32_t tolerance_missed = 0;            // whose estimate is too large with the finest step there is
    Real error_rate = 0;                           // [m/s], largest of the present estimates of position error, per second
    const StepProfile* profile = nullptr;          // with WorldSettings::profile; the world's own, until its next step
    const StepDiagnostics* diagnostics = nullptr;  // with WorldSettings::diagnostics; likewise
};

}  // namespace cairn
