#include "apps/cli/runner.hpp"

#include "apps/cli/allocations.hpp"
#include "apps/cli/options.hpp"
#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace cairn::cli {

namespace {

double median(std::vector<double> x) {
    if (x.empty()) return 0;
    const std::size_t half = x.size() / 2;
    std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(half), x.end());
    if (x.size() % 2 == 1) return x[half];
    return (x[half] + *std::max_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(half))) / 2;
}

void add_report(const StepReport& report, Real dt, RunResult& result) {
    result.ok = result.ok && report.ok;
    result.contacts_max = std::max(result.contacts_max, report.contacts);
    result.contacts_end = report.contacts;
    result.sleeping_end = report.sleeping_bodies;
    result.bodies_disabled += report.bodies_disabled;
    for (int k = 0; k < kSolverChoices; ++k) result.islands_of[k] += report.islands_of[k];
    result.fcl_calls += report.fcl_calls;
    result.fcl_failures += report.fcl_failures;
    result.max_penetration = std::max(result.max_penetration, report.max_penetration);
    result.estimated_error += report.error_rate * dt;
    result.error_estimates += report.error_estimates;
    result.steps_refined += report.steps_refined;
    result.tolerance_missed += report.tolerance_missed;
}

[[noreturn]] void throw_refused(const Scene& scene, const RunOptions& options, const StepReport& report, Real t) {
    throw_invalid("--solver", solver_name(*options.solver),
                  fmt::format("one that takes the island of bodies[{}] ({}) at t = {:.4g} s: auto or si", report.refused_body,
                              scene.bodies[report.refused_body].name, t));
}

void add_energy(const World& world, RunResult& result) {
    const Real kinetic = world.kinetic_energy();
    result.energy_end = kinetic + world.potential_energy();
    result.energy_max = std::max(result.energy_max, result.energy_end);
    result.kinetic_max = std::max(result.kinetic_max, kinetic);
}

}  // namespace

WorldSettings settings_from(const RunOptions& options) {
    WorldSettings settings;
    if (options.substeps) settings.substeps = *options.substeps;
    if (options.iterations) settings.iterations = *options.iterations;
    if (options.threads) settings.threads = *options.threads;
    if (options.sleep) settings.sleep = *options.sleep;
    if (options.solver) settings.solver = *options.solver;
    if (options.model) settings.model = *options.model;
    if (options.stabilisation) settings.stabilisation = *options.stabilisation;
    if (options.residual_tolerance) settings.residual_tolerance = *options.residual_tolerance;
    if (options.tolerance) settings.tolerance = *options.tolerance;
    settings.profile = options.profile;
    settings.diagnostics = options.diagnostics;
    return settings;
}

long step_count(Real duration, Real dt) {
    constexpr Real kMost = 1e8;
    const Real steps = std::round(duration / dt);
    if (!(steps <= kMost)) throw_invalid("--dt", dt, "at least a hundred-millionth of the scene's duration");
    return std::max(1L, static_cast<long>(steps));
}

std::vector<long> sample_steps(Real sample_interval, Real dt, long steps) {
    std::vector<long> due;
    // With multiples no farther apart than the steps, every step is the nearest to one of them.
    const bool every = sample_interval <= dt;
    for (long k = 1;; ++k) {
        const Real nearest = every ? static_cast<Real>(k) : std::round(static_cast<Real>(k) * sample_interval / dt);
        if (!(nearest < static_cast<Real>(steps))) break;
        due.push_back(static_cast<long>(nearest));
    }
    due.push_back(steps);
    return due;
}

RunResult run_scene(const Scene& scene, const RunOptions& options, const SampleCallback& on_sample, const StepCallback& on_step,
                    const ReportCallback& on_report) {
    using Clock = std::chrono::steady_clock;
    RunResult result;
    result.dt = options.dt;
    const long steps = step_count(scene.duration, options.dt);
    const std::vector<long> due = sample_steps(scene.sample_interval, options.dt, steps);
    SceneWorld built = build_world(scene, settings_from(options));
    result.settings = built.world.settings();
    if (options.profile) result.profile.emplace();
    result.energy_start = built.world.kinetic_energy() + built.world.potential_energy();
    result.energy_max = result.energy_start;
    add_energy(built.world, result);
    if (on_sample) on_sample(0, built);

    std::vector<double> walls;
    walls.reserve(static_cast<std::size_t>(steps));
    std::size_t next_sample = 0;
    for (long step = 1; step <= steps; ++step) {
        const std::uint64_t allocations_before = allocations_so_far();
        const Clock::time_point start = Clock::now();
        const StepReport report = built.world.step(options.dt);
        walls.push_back(std::chrono::duration<double>(Clock::now() - start).count());
        if (report.islands_refused > 0) throw_refused(scene, options, report, static_cast<Real>(step) * options.dt);
        add_report(report, options.dt, result);
        if (result.profile) result.profile->add(report, walls.back(), allocations_so_far() - allocations_before);
        if (on_report) on_report(static_cast<Real>(step) * options.dt, built, report);
        if (step == due[next_sample]) {
            ++next_sample;
            add_energy(built.world, result);
            if (on_sample) on_sample(static_cast<Real>(step) * options.dt, built);
        }
        if (on_step) on_step(step, steps);
    }
    result.steps = steps;
    for (const double wall : walls) result.wall_total += wall;
    result.wall_max_step = *std::max_element(walls.begin(), walls.end());
    result.wall_median_step = median(std::move(walls));
    return result;
}

}  // namespace cairn::cli
