// What a benchmark is made of: scenes × engines × solvers × steps × substeps or iterations, as a list of cases in a fixed order.
#pragma once

#include "apps/cli/engine_run.hpp"

#include <memory>
#include <string>
#include <vector>

namespace cairn::cli {

// As the command line gives them; comma-separated lists. Empty: what the size of the benchmark says.
struct BenchRequest {
    std::string filter;                 // part of a scene's name
    std::vector<std::string> scenes;    // exact names or files; empty: all
    std::string folder;                 // scene files of this folder instead of the shipped and generated ones
    std::string engines;                // empty: Cairn and the adapters of this build; "none": the external ones alone
    std::vector<std::string> external;  // NAME=PATH
    std::string solvers, dt, substeps, iterations, residual_tolerances, tolerances;
    std::string threads;          // Cairn's; empty: 1
    bool work_precision = false;  // the scenes and steps that show orders of convergence
    bool sleep = false;
    bool quick = false;
    bool full = false;
    std::string shard;  // "i/n": every n-th case, from the i-th (1 … n)
};

struct BenchCase {
    std::shared_ptr<const SceneFile> file;
    EngineChoice engine;
    EngineSettings settings;
    std::string dt;  // as text: 1/60 is not 0.0166667
    int place = 0;   // in the whole plan, before it is shared among shards

    // Names the case in results: everything that it asks for.
    std::string id() const;
    // The command that repeats it alone.
    std::string command() const;
    // Work to expect, in body steps: for the time left.
    double cost() const;
};

// Throws Error that says what would be valid.
std::vector<BenchCase> plan_cases(const BenchRequest& request);

}  // namespace cairn::cli
