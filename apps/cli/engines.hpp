// The engines that can be run from here: Cairn itself, and the adapters of others that were built (apps/cli/rivals).
#pragma once

#include "apps/cli/rivals/rival.hpp"
#include "apps/cli/runner.hpp"

#include <memory>
#include <string>
#include <vector>

namespace cairn::cli {

// What a run asks of any engine.
struct EngineSettings {
    Real dt = 1.0 / 60;  // [s], the outer step
    std::optional<int> substeps;
    std::optional<int> iterations;
    bool sleep = false;
    std::optional<SolverChoice> solver;      // Cairn's; ignored by others
    std::optional<Real> residual_tolerance;  // [m/s], Cairn's; ignored by others
    std::optional<Real> tolerance;           // [m/s], Cairn's; ignored by others
    bool profile = false;                    // Cairn's: measure where the time goes
    int threads = 1;                         // Cairn's; the adapters run on one
};

// Names that make_engine takes, of what is built here: "cairn", "bullet", "bullet64", "bullet64-2dir", "ode", "ode-worldstep" …
std::vector<std::string> engine_names();

// The folder of the adapters' modules: CAIRN_RIVALS of the environment, or else lib/cairn/rivals beside this program's own folder.
std::string rival_folder();

// An engine with the scene's bodies and joints, ready to step. The scene must outlive it. NAME is an engine, or ENGINE-VARIANT.
// Throws Error if there is no such engine, Unsupported if it lacks what the scene asks for.
std::unique_ptr<Rival> make_engine(const std::string& name, const Scene& scene, const EngineSettings& settings);

}  // namespace cairn::cli
