#include "apps/cli/commands.hpp"
#include "apps/cli/generate.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/report.hpp"
#include "apps/cli/shipped_scenes.hpp"
#include "apps/cli/truths.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <memory>

namespace cairn::cli {

namespace {

struct Arguments {
    RunArguments run;
    std::string filter;
    bool quick = false;
};

// Too large for files; from the generator, with its first seed.
struct Large {
    const char* kind;
    int count;
};
constexpr Large kLarge[] = {{"pyramid", 40}, {"pile", 2000}, {"ragdolls", 50}};
constexpr std::size_t kQuickBodies = 30;

// The scenes whose name holds the filter, shipped ones first.
std::vector<Scene> chosen_scenes(const Arguments& arguments) {
    std::vector<Scene> scenes;
    const auto wanted = [&](const std::string& name) { return name.find(arguments.filter) != std::string::npos; };
    for (const std::string& name : shipped_scene_names()) {
        if (!wanted(name)) continue;
        Scene scene = load_scene(find_scene(name));
        if (!arguments.quick || scene.bodies.size() <= kQuickBodies) scenes.push_back(std::move(scene));
    }
    if (arguments.quick) return scenes;
    for (const Large& large : kLarge) {
        if (!wanted(std::string(large.kind) + "_" + std::to_string(large.count))) continue;
        const GeneratedScene made = generate_scene(generator(large.kind), large.count, 1);
        scenes.push_back(parse_scene(made.text, made.name));
    }
    return scenes;
}

std::string truth_text(const Scene& scene, const History& history) {
    const TruthFunction truth = truth_of(scene.name);
    if (truth == nullptr) return fmt::format("{:>10}  {}", "-", "-");
    const TruthError error = truth(scene, history);
    return fmt::format("{:>10.2e}  {}{}", error.value, error.what,
                       std::string(error.unit) == "1" ? "" : std::string(" [") + error.unit + "]");
}

// Runs one scene and prints its row; false if the run reported a failure.
bool bench_scene(const Scene& scene, const RunOptions& options) {
    if (const std::vector<std::string> missing = unsupported_features(scene); !missing.empty()) {
        fmt::print("{:<16} not supported: {}\n", scene.name, missing.front());
        return true;
    }
    History history;
    const SampleCallback on_sample = [&](Real t, const SceneWorld& built) {
        history.t.push_back(t);
        std::vector<BodyState>& states = history.states.emplace_back();
        for (const BodyId id : built.ids) states.push_back(built.world.state(id));
    };
    RunResult r;
    {
        Progress progress(true);
        r = run_scene(scene, options, on_sample, [&](long done, long all) { progress.update(done, all); });
    }
    fmt::print("{:<16} {:>6} {:>6} {:>10} {:>10.2e} {:>10.2e} {:>6}  {}\n", scene.name, scene.bodies.size(), r.steps,
               readable_time(r.wall_median_step), r.max_penetration, r.energy_max - r.energy_start, r.fcl_failures,
               truth_text(scene, history));
    for (const std::string& warning : warnings(scene, r)) fmt::print("{:<16}   warning: {}\n", "", warning);
    std::fflush(stdout);
    return r.ok;
}

int bench(const Arguments& arguments) {
    const RunOptions options = run_options(arguments.run);
    const std::vector<Scene> scenes = chosen_scenes(arguments);
    if (scenes.empty()) throw_invalid("--filter", arguments.filter, "part of the name of a scene (see: cairn list)");
    const WorldSettings settings = settings_from(options);
    fmt::print("dt {:.6g} s, {} substeps, {} iterations, {} threads, sleep {}\n", options.dt, settings.substeps, settings.iterations,
               settings.threads, settings.sleep ? "on" : "off");
    fmt::print("{:<16} {:>6} {:>6} {:>10} {:>10} {:>10} {:>6} {:>10}  {}\n", "scene", "bodies", "steps", "per step", "depth [m]",
               "rise [J]", "failed", "error", "of");
    bool ok = true;
    for (const Scene& scene : scenes) ok = bench_scene(scene, options) && ok;
    return ok ? kSuccess : kRunFailed;
}

}  // namespace

void add_bench_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("bench", "Run many scenes and print a table of times and errors");
    const std::shared_ptr<Arguments> arguments = std::make_shared<Arguments>();
    command->add_option("--filter", arguments->filter, "Only scenes with this in their name");
    command->add_flag("--quick", arguments->quick, "Only scenes of at most 30 bodies");
    add_run_options(*command, arguments->run);
    command->footer(
        "per step: median time of a step.  depth: deepest contact at the start of any step.  rise: most that the energy rose over its\n"
        "start.  failed: narrow-phase queries.  error: against what is known in closed form (relative, where no unit is given).\n"
        "Examples:\n"
        "  cairn bench --quick\n"
        "  cairn bench --filter slide --dt 1/240");
    command->callback([arguments, &exit_code] { exit_code = bench(*arguments); });
}

}  // namespace cairn::cli
