// Command-line options that every command which runs scenes shares.
#pragma once

#include "apps/cli/model_options.hpp"
#include "apps/cli/runner.hpp"

#include <CLI/CLI.hpp>

#include <string>

namespace cairn::cli {

// A time step: a number or a fraction of two, as in 0.01 or 1/240. Throws Error if it is neither, not finite or not > 0.
Real parse_time_step(const std::string& text);

// The options as text where the command line has text; checked by run_options().
struct RunArguments {
    std::string dt = "1/60";
    std::string solver = "auto";
    std::string stabilisation;
    std::optional<int> substeps;
    std::optional<int> iterations;
    std::optional<int> threads;
    std::optional<int> sleep;
    std::optional<double> residual_tolerance;
    std::optional<double> tolerance;
    ModelArguments model;
};

void add_run_options(CLI::App& command, RunArguments& arguments);

// Throws Error naming the option, its value and what would be valid.
RunOptions run_options(const RunArguments& arguments);

const char* solver_name(SolverChoice solver);
// All of them: "auto, si, …".
std::string solver_names();

}  // namespace cairn::cli
