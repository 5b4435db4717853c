#include "apps/cli/report.hpp"

#include "apps/cli/options.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace cairn::cli {

namespace {

// Constant forces and driven bodies do work, so the energy says nothing of the engine.
bool is_driven(const Scene& scene) {
    return std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyDef& b) {
        return b.motion || !b.force.isZero(0) || !b.torque.isZero(0) ||
               (b.type == BodyType::kKinematic && !(b.linear_velocity.isZero(0) && b.angular_velocity.isZero(0)));
    });
}

}  // namespace

std::string readable_time(double seconds) {
    if (seconds < 1e-3) return fmt::format("{:.1f} µs", 1e6 * seconds);
    if (seconds < 1) return fmt::format("{:.2f} ms", 1e3 * seconds);
    return fmt::format("{:.2f} s", seconds);
}

std::vector<std::string> warnings(const Scene& scene, const RunResult& r) {
    std::vector<std::string> list;
    if (!r.ok)
        list.push_back(
            fmt::format("{} bodies went non-finite; they were put back to their last finite pose and disabled", r.bodies_disabled));
    if (r.fcl_failures > 0)
        list.push_back(fmt::format("{} narrow-phase queries failed; those pairs kept their last contacts", r.fcl_failures));
    // Half of the scale is far beyond what a step of any sensible size does to the energy.
    if (!is_driven(scene) && r.energy_max - r.energy_start > 0.5 * std::max(r.kinetic_max, 1e-9)) {
        list.push_back(
            fmt::format("the energy rose by {:.3g} J; a smaller --dt or more --substeps may help", r.energy_max - r.energy_start));
    }
    return list;
}

std::string runner_line(const Scene& scene, const RunResult& r) {
    nlohmann::ordered_json line;
    line["engine"] = "cairn";
    line["version"] = CAIRN_VERSION;
    line["precision"] = 64;
    line["scene"] = scene.name;
    line["dt"] = r.dt;
    line["substeps"] = r.settings.substeps;
    line["iterations"] = r.settings.iterations;
    line["threads"] = r.settings.threads;
    line["sleep"] = r.settings.sleep ? 1 : 0;
    line["steps"] = r.steps;
    line["wall_total_s"] = r.wall_total;
    line["wall_median_step_s"] = r.wall_median_step;
    line["wall_max_step_s"] = r.wall_max_step;
    line["unsupported"] = nlohmann::json::array();  // Cairn takes all of the format
    line["notes"] = r.steps > 0 ? warnings(scene, r) : std::vector<std::string>{};
    line["settings"] = {{"solver", solver_name(r.settings.solver)},
                        {"stabilisation", stabilisation_name(r.settings.stabilisation)},
                        {"residual_tolerance", r.settings.residual_tolerance},
                        {"tolerance", r.settings.tolerance},
                        {"model", model_names(r.settings.model)}};
    if (r.settings.tolerance > 0) {
        line["error_control"] = {{"estimated_error_m", r.estimated_error},
                                 {"estimates", r.error_estimates},
                                 {"refined", r.steps_refined},
                                 {"missed", r.tolerance_missed}};
    }
    if (r.profile) line["profile"] = profile_json(*r.profile);
    return line.dump();
}

std::string summary(const Scene& scene, const RunResult& r) {
    const Real simulated = static_cast<Real>(r.steps) * r.dt;
    const double wall = std::max(r.wall_total, 1e-12);
    std::string text = fmt::format("{}: {} bodies, {} joints\n", scene.name, scene.bodies.size(), scene.joints.size());
    const auto row = [&text](const char* name, const std::string& value) { text += fmt::format("  {:<18} {}\n", name, value); };
    row("steps", fmt::format("{} of {:.6g} s, {:.6g} s simulated", r.steps, r.dt, simulated));
    row("time per step", fmt::format("{} median, {} longest", readable_time(r.wall_median_step), readable_time(r.wall_max_step)));
    row("real-time factor", fmt::format("{:.3g} (simulated time / time in steps, {})", simulated / wall, readable_time(r.wall_total)));
    std::string solvers;
    for (int k = 0; k < kSolverChoices; ++k) {
        if (r.islands_of[k] > 0)
            solvers += fmt::format("{}{} {}", solvers.empty() ? "" : ", ", r.islands_of[k], solver_name(static_cast<SolverChoice>(k)));
    }
    if (!solvers.empty()) row("islands solved", solvers);
    row("contacts", fmt::format("{} at the end, {} at most", r.contacts_end, r.contacts_max));
    row("worst penetration", fmt::format("{:.3g} m", r.max_penetration));
    if (is_driven(scene)) {
        row("energy", "not compared: driven by forces or motions");
    } else {
        row("energy", fmt::format("{:+.3g} J from {:.6g} J at the start; highest {:+.3g} J", r.energy_end - r.energy_start, r.energy_start,
                                  r.energy_max - r.energy_start));
    }
    if (r.settings.tolerance > 0) {
        row("estimated error", fmt::format("{:.3g} m of {:.3g} m admitted; {} estimates, {} steps refined, {} missed", r.estimated_error,
                                           r.settings.tolerance * simulated, r.error_estimates, r.steps_refined, r.tolerance_missed));
    }
    row("asleep at the end", fmt::format("{} bodies", r.sleeping_end));
    row("narrow phase", fmt::format("{} calls into FCL, {} queries failed", r.fcl_calls, r.fcl_failures));
    if (r.profile) text += profile_table(*r.profile);
    for (const std::string& warning : warnings(scene, r)) text += "  warning: " + warning + '\n';
    return text;
}

}  // namespace cairn::cli
