#include "apps/cli/options.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string_view>

namespace cairn::cli {

namespace {

struct NamedSolver {
    const char* name;
    SolverChoice value;
};
constexpr NamedSolver kSolvers[kSolverChoices] = {{"auto", SolverChoice::kAuto},     {"si", SolverChoice::kSi},
                                                  {"direct", SolverChoice::kDirect}, {"rattle", SolverChoice::kRattle},
                                                  {"mixed", SolverChoice::kMixed},   {"tgs", SolverChoice::kTgs}};

// The whole text as a number; false if it is not one.
bool whole_number(std::string_view text, Real& out) {
    const std::from_chars_result read = std::from_chars(text.data(), text.data() + text.size(), out);
    return read.ec == std::errc() && read.ptr == text.data() + text.size();
}

void require_at_least_one(const char* option, const std::optional<int>& value) {
    if (value && *value < 1) throw_invalid(option, std::to_string(*value), "a whole number >= 1");
}

}  // namespace

Real parse_time_step(const std::string& text) {
    const std::size_t slash = text.find('/');
    const std::string_view view = text;
    Real above = 0, below = 1;
    const bool numbers =
        whole_number(view.substr(0, slash), above) && (slash == std::string::npos || whole_number(view.substr(slash + 1), below));
    const Real dt = above / below;
    if (!numbers || !std::isfinite(dt) || !(dt > 0)) throw_invalid("--dt", text, "a number of seconds > 0 or a fraction such as 1/240");
    return dt;
}

void add_run_options(CLI::App& command, RunArguments& a) {
    const WorldSettings defaults;
    const auto with_default = [](const char* text, const auto& value) { return fmt::format("{} (default {})", text, value); };
    command.add_option("--dt", a.dt, "Step [s]: a number or a fraction such as 1/240")->capture_default_str();
    command.add_option("--substeps", a.substeps, with_default("Substeps of a step", defaults.substeps));
    command.add_option("--iterations", a.iterations, with_default("Most sweeps of a solve", defaults.iterations));
    command.add_option("--threads", a.threads, with_default("Threads", defaults.threads));
    command.add_option("--sleep", a.sleep, with_default("1: bodies at rest fall asleep, 0: they do not", defaults.sleep ? 1 : 0));
    command
        .add_option("--solver", a.solver,
                    "auto: chosen per island; si: sequential impulses; direct: contacts without joints and restitution; rattle: joints "
                    "alone; mixed: joints with contacts; tgs: soft contacts and joints, one sweep a solve")
        ->capture_default_str();
    command.add_option("--stabilisation", a.stabilisation,
                       with_default("How position errors are worked off: split, target-velocity, soft or none",
                                    stabilisation_name(defaults.stabilisation)));
    command.add_option("--residual-tolerance,--until", a.residual_tolerance,
                       with_default("A solve stops early once no row changes a velocity by more [m/s]", defaults.residual_tolerance));
    command.add_option(
        "--tolerance", a.tolerance,
        with_default("Position error admitted per simulated second [m/s]: substeps and sweeps follow from it; 0: they do not",
                     defaults.tolerance));
    add_model_options(command, a.model);
}

RunOptions run_options(const RunArguments& a) {
    RunOptions options;
    options.dt = parse_time_step(a.dt);
    require_at_least_one("--substeps", a.substeps);
    require_at_least_one("--iterations", a.iterations);
    require_at_least_one("--threads", a.threads);
    if (a.sleep && *a.sleep != 0 && *a.sleep != 1) throw_invalid("--sleep", std::to_string(*a.sleep), "0 or 1");
    if (a.residual_tolerance && !(std::isfinite(*a.residual_tolerance) && *a.residual_tolerance >= 0)) {
        throw_invalid("--residual-tolerance", *a.residual_tolerance, ">= 0");
    }
    if (a.tolerance && !(std::isfinite(*a.tolerance) && *a.tolerance >= 0)) throw_invalid("--tolerance", *a.tolerance, ">= 0");
    for (const NamedSolver& s : kSolvers) {
        if (a.solver == s.name) options.solver = s.value;
    }
    if (!options.solver) throw_invalid("--solver", a.solver, "one of " + solver_names());
    options.substeps = a.substeps;
    options.iterations = a.iterations;
    options.threads = a.threads;
    if (a.sleep) options.sleep = *a.sleep == 1;
    options.residual_tolerance = a.residual_tolerance;
    options.tolerance = a.tolerance;
    if (!a.stabilisation.empty()) options.stabilisation = stabilisation_from(a.stabilisation);
    options.model = model_from(a.model);
    if (options.model && *options.solver == SolverChoice::kAuto) options.solver = SolverChoice::kSi;
    return options;
}

const char* solver_name(SolverChoice solver) {
    for (const NamedSolver& s : kSolvers) {
        if (solver == s.value) return s.name;
    }
    return "unknown";
}

std::string solver_names() {
    std::string names;
    for (const NamedSolver& s : kSolvers) names.append(names.empty() ? "" : ", ").append(s.name);
    return names;
}

}  // namespace cairn::cli
