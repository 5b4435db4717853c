// Which solver an island gets, and how many substeps.
#pragma once

#include "engine/step_diagnostics.hpp"
#include "solver/direct.hpp"
#include "solver/mixed.hpp"

#include <cstdint>
#include <unordered_map>

namespace cairn {

struct WorldData;
struct IslandWorkspace;
struct StepReport;

// What the direct solver keeps for an island from step to step, by the island's lowest body: its factor, and how it fared. A function of
// the world's history alone.
struct DirectState {
    DirectCache cache;
    int wait = 0;        // steps until it is tried again
    int penalty = 1;     // steps to wait after the next failure
    double credit = 0;   // block products that it may spend, see choose_solver.cpp
    int restless = 0;    // solves in a row that found it out of balance
    bool stood = false;  // since the last step in which it was solved
    std::uint64_t last_step = 0;
    int points = 0;  // of contact, then
};

// How fast the fastest body of an island is: no faster than its own acceleration makes it from rest in one step, in four, or more.
enum class Pace : std::uint8_t { kQuiet, kSlow, kFast };

struct SolverPlan {
    SolverChoice solver = SolverChoice::kSi;
    int substeps = 1;
    int substeps_if_wide = 1;  // of sweeps four contacts at a time
    Pace pace = Pace::kFast;
    SolverReason reason = SolverReason::kForced;
    DirectState* direct = nullptr;
    int most_factorisations = DirectSettings{}.most_factorisations;
};

// The solver for island `index`, whose rows are in `island`. A forced solver is returned even if it cannot take the island.
SolverPlan choose_solver(WorldData& world, IslandWorkspace& work, int index, const SiIsland& island, Real dt);

// Whether a solver can solve an island at all.
bool takes(SolverChoice solver, const SiIsland& island);

// Tells the choice how the direct solver fared on an island with so many contact points.
void note_direct(DirectState& state, int points, const DirectReport& report);

}  // namespace cairn
