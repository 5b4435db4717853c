// Runs a scene: builds its world, steps it to the end, hands out samples.
#pragma once

#include "apps/cli/profile.hpp"
#include "engine/scene/scene.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cairn::cli {

// What a run is asked for. What is not given is WorldSettings' own default.
struct RunOptions {
    Real dt = 1.0 / 60;  // [s], the outer step
    std::optional<int> substeps;
    std::optional<int> iterations;
    std::optional<int> threads;
    std::optional<bool> sleep;
    std::optional<SolverChoice> solver;
    std::optional<Stabilisation> stabilisation;
    std::optional<SiModel> model;
    std::optional<Real> residual_tolerance;  // [m/s]
    std::optional<Real> tolerance;           // [m/s]
    bool profile = false;                    // measure where the time goes
    bool diagnostics = false;                // measure how well each step is solved
};

WorldSettings settings_from(const RunOptions& options);

// What a run did.
struct RunResult {
    WorldSettings settings;
    Real dt = 0;  // [s]
    long steps = 0;
    bool ok = true;  // no step reported a failure
    // Time inside World::step alone [s].
    double wall_total = 0;
    double wall_median_step = 0;
    double wall_max_step = 0;
    std::uint32_t contacts_max = 0;  // points in any step
    std::uint32_t contacts_end = 0;
    std::uint32_t sleeping_end = 0;  // bodies
    std::uint32_t bodies_disabled = 0;
    std::uint64_t islands_of[kSolverChoices] = {};  // islands solved, by solver, over all steps
    std::uint64_t fcl_calls = 0;
    std::uint64_t fcl_failures = 0;
    Real max_penetration = 0;  // [m]
    // With a tolerance: the steps' largest estimates summed [m], and what they cost.
    Real estimated_error = 0;
    std::uint64_t error_estimates = 0;
    std::uint64_t steps_refined = 0;
    std::uint64_t tolerance_missed = 0;
    Real energy_start = 0;     // [J], kinetic and potential, at t = 0 and at the samples
    Real energy_end = 0;
    Real energy_max = 0;
    Real kinetic_max = 0;               // [J]
    std::optional<RunProfile> profile;  // if asked for
};

// Called at t = 0, after the step nearest each multiple of the sample interval (with that step's own time), and after the last step.
using SampleCallback = std::function<void(Real t, const SceneWorld& built)>;
// Called after every step, with its time.
using ReportCallback = std::function<void(Real t, const SceneWorld& built, const StepReport& report)>;
// Called after every step with the steps done, of all.
using StepCallback = std::function<void(long done, long steps)>;

// max(1, round(duration / dt)). Throws Error if that is more than a hundred million.
long step_count(Real duration, Real dt);

// The steps, of 1 … steps, after which a sample is due: those nearest a multiple of the interval [s], and the last; ascending.
std::vector<long> sample_steps(Real sample_interval, Real dt, long steps);

// Throws Error when a forced solver cannot take an island.
RunResult run_scene(const Scene& scene, const RunOptions& options, const SampleCallback& on_sample = {}, const StepCallback& on_step = {},
                    const ReportCallback& on_report = {});

}  // namespace cairn::cli
