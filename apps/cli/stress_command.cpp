#include "apps/cli/commands.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/stress/stress_file.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

namespace cairn::cli {

namespace {

struct Arguments {
    std::string limits;
    std::string engines;
    std::vector<std::string> external;
    std::string solvers = "auto";
    std::string out;
    double timeout = 0;  // [s]; 0: as the size says
    bool quick = false;
};

// An engine, and for Cairn one of its solvers.
struct Contestant {
    EngineChoice engine;
    std::optional<SolverChoice> solver;
    std::string label;
};

std::vector<Contestant> contestants(const Arguments& a) {
    std::string names = a.engines;
    if (names.empty() && a.external.empty()) {
        names = "cairn";
        const std::vector<std::string> known = engine_names();
        for (const char* name : {"bullet64", "ode"}) {
            if (std::find(known.begin(), known.end(), name) != known.end()) names += std::string(",") + name;
        }
    }
    std::vector<Contestant> list;
    for (const EngineChoice& engine : parse_engines(names, a.external)) {
        if (engine.name != "cairn") {
            list.push_back({engine, {}, engine.name});
            continue;
        }
        for (std::size_t start = 0; start < a.solvers.size();) {
            const std::size_t comma = std::min(a.solvers.find(',', start), a.solvers.size());
            RunArguments arguments;
            arguments.solver = a.solvers.substr(start, comma - start);
            list.push_back({engine, run_options(arguments).solver, arguments.solver == "auto" ? "cairn" : "cairn " + arguments.solver});
            start = comma + 1;
        }
    }
    return list;
}

std::vector<Limit> chosen_limits(const std::string& filter) {
    std::vector<Limit> limits;
    std::string names;
    for (Limit& limit : all_limits()) {
        names += (names.empty() ? "" : ", ") + std::string(limit.name);
        if (std::string(limit.name).find(filter) != std::string::npos) limits.push_back(std::move(limit));
    }
    if (limits.empty()) throw_invalid("--filter", filter, "part of one of " + names);
    return limits;
}

std::string cell(const LimitResult& r) {
    if (!r.note.empty()) return "n/a";
    if (r.held < 0) return fmt::format("none");
    return fmt::format("{}{:.3g}", r.held + 1 == r.rungs ? ">= " : "", r.value);
}

int stress(const Arguments& a) {
    const std::vector<Limit> limits = chosen_limits(a.limits);
    const std::vector<Contestant> all = contestants(a);
    StressSettings settings;
    settings.quick = a.quick;
    settings.timeout = a.timeout > 0 ? a.timeout : a.quick ? 3 : 60;
    if (!a.out.empty()) {
        settings.scene_folder = (std::filesystem::path(a.out) / "scenes").string();
        std::error_code error;
        std::filesystem::create_directories(settings.scene_folder, error);
        if (!std::filesystem::is_directory(settings.scene_folder)) throw Error("--out: " + a.out + ": cannot be made a folder");
    }
    fmt::print("highest rung that is held; steps of 1/60 s, each engine's defaults, no sleep\n{:<17}", "limit");
    for (const Contestant& c : all) fmt::print(" {:>12}", c.label);
    fmt::print("  of\n");
    std::fflush(stdout);
    std::vector<StressRow> rows;
    Progress progress(true);
    for (std::size_t k = 0; k < limits.size(); ++k) {
        const Limit& limit = limits[k];
        std::string line = fmt::format("{:<17}", limit.name);
        for (std::size_t i = 0; i < all.size(); ++i) {
            settings.engine.solver = all[i].solver;
            rows.push_back({search_limit(limit, all[i].engine, settings), limit.what, limit.unit, limit.criterion});
            line += fmt::format(" {:>12}", cell(rows.back().result));
            progress.update(static_cast<long>(k * all.size() + i + 1), static_cast<long>(limits.size() * all.size()));
        }
        fmt::print("{}  {}{}; {}\n", line, limit.what, *limit.unit == '\0' ? "" : fmt::format(" [{}]", limit.unit), limit.criterion);
        std::fflush(stdout);
    }
    if (!a.out.empty()) {
        write_stress(a.out, this_machine(), rows);
        fmt::print("results: {0}/stress.json, scenes of the last rung held and the first one lost: {0}/scenes\n", a.out);
    }
    return kSuccess;
}

}  // namespace

void add_stress_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("stress", "Search the limits of stability, by bisection");
    const std::shared_ptr<Arguments> a = std::make_shared<Arguments>();
    command->add_option("--filter", a->limits, "Only limits with this in their name");
    command->add_option("--engines", a->engines,
                        fmt::format("List of engines (of {}); default: cairn and the best of each", fmt::join(engine_names(), ", ")));
    command->add_option("--engine", a->external, "NAME=PATH of a program that follows the runner protocol; may be given again")
        ->allow_extra_args(false);
    command->add_option("--solver", a->solvers, "List of Cairn's solvers: " + solver_names())->capture_default_str();
    command->add_option("--timeout", a->timeout, "Longest run [s]: what takes longer has failed; default 60, with --quick 3");
    command->add_flag("--quick", a->quick, "Shorter scenes: under three minutes");
    command->add_option("--out", a->out, "Folder for results");
    std::string text = "Limits:\n";
    for (const Limit& limit : all_limits()) text += fmt::format("  {:<17} {}; {}\n", limit.name, limit.what, limit.criterion);
    command->footer(text +
                    "Examples:\n"
                    "  cairn stress --quick\n"
                    "  cairn stress --filter stack --engines cairn,bullet64,ode-worldstep --solver si,direct");
    command->callback([a, &exit_code] { exit_code = stress(*a); });
}

}  // namespace cairn::cli
