// Where the time of a run goes: the engine's own measurements, summed over the steps.
#pragma once

#include "engine/step_report.hpp"

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace cairn::cli {

// Sums over the steps of a run.
struct RunProfile {
    long steps = 0;
    double wall = 0;  // [s], in World::step as seen from outside
    double seconds[kPhases] = {};
    std::uint64_t queries_of[kShapeTypes][kShapeTypes] = {};
    std::uint64_t fcl_calls_of[kShapeTypes][kShapeTypes] = {};
    std::uint64_t proxies_moved = 0, pairs_begun = 0, pairs_ended = 0;
    std::uint64_t pairs = 0, manifolds = 0, contacts = 0, manifolds_reused = 0, queries = 0, separating_axis_hits = 0, fcl_calls = 0;
    std::uint64_t normal_rows = 0, friction_rows = 0, joint_rows = 0, contact_sweeps = 0, joint_sweeps = 0, factorisations = 0;
    std::uint64_t islands_of[kSolverChoices] = {};
    std::uint64_t free_bodies = 0, sleeping_bodies = 0;
    std::uint64_t allocations = 0;

    // `report` must have a profile.
    void add(const StepReport& report, double step_wall, std::uint64_t step_allocations);
};

// Of the stages, as in `seconds` above, and of what is left: "broad_phase" … "sleep", "rest".
const std::vector<const char*>& phase_keys();

// For people: a table of the stages, then what they did, a step.
std::string profile_table(const RunProfile& profile);
// For programs: times in s and counts over the whole run (docs/formats.md).
nlohmann::ordered_json profile_json(const RunProfile& profile);

}  // namespace cairn::cli
