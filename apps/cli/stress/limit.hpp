// Limits of stability: a ladder of ever harder scenes, a criterion, and the highest rung that an engine still holds.
#pragma once

#include "apps/cli/engine_run.hpp"

#include <string>
#include <vector>

namespace cairn::cli {

struct Limit {
    const char* name;           // as on the command line
    const char* what;           // one line: what grows
    const char* unit;           // of the rungs; "" for a count or a ratio
    const char* criterion;      // in words: what a run that passes does
    std::vector<double> rungs;  // from easy to hard
    // The scene of a rung, as a scene file; `quick` may shorten it, never ease it.
    std::string (*scene)(double rung, bool quick);
    // Why the run does not pass; empty: it does.
    std::string (*verdict)(const Scene& scene, const EngineRun& run);
    // The step [s] of a rung; nullptr: 1/60 s.
    double (*dt)(double rung) = nullptr;
};

// One file for each family of limits.
std::vector<Limit> stack_limits();
std::vector<Limit> ratio_limits();
std::vector<Limit> joint_limits();
std::vector<Limit> structure_limits();
std::vector<Limit> material_limits();
std::vector<Limit> size_limits();
std::vector<Limit> speed_limits();
std::vector<Limit> driven_limits();

// All of them, in the order of the table.
std::vector<Limit> all_limits();

// Geometric ladder from first to last (both included) with this many rungs; `whole` rounds and drops doubles.
std::vector<double> ladder(double first, double last, int count, bool whole = false);

// Criteria that several limits share. Each gives the reason for failing, or nothing.
std::string moved_more_than(const Scene& scene, const EngineRun& run, Real limit);
std::string stretched_more_than(const Scene& scene, const EngineRun& run, Real limit);

}  // namespace cairn::cli
