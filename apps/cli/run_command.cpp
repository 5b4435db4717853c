#include "apps/cli/commands.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/report.hpp"
#include "apps/cli/shipped_scenes.hpp"
#include "apps/cli/states_file.hpp"
#include "apps/cli/step_report_file.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace cairn::cli {

namespace {

struct Arguments {
    std::string scene;
    RunArguments run;
    std::string states;
    std::string report;
    bool json = false;
    bool quiet = false;
    bool profile = false;
};

int run(const Arguments& arguments) {
    RunOptions options = run_options(arguments.run);
    options.profile = arguments.profile;
    options.diagnostics = !arguments.report.empty();
    const Scene scene = load_scene(find_scene(arguments.scene));
    std::unique_ptr<StatesFile> states;
    SampleCallback on_sample;
    if (!arguments.states.empty()) {
        states = std::make_unique<StatesFile>(arguments.states);
        on_sample = [&](Real t, const SceneWorld& built) { states->write_sample(t, scene, built); };
    }
    std::unique_ptr<StepReportFile> reports;
    ReportCallback on_report;
    if (!arguments.report.empty()) {
        reports = std::make_unique<StepReportFile>(arguments.report);
        on_report = [&](Real t, const SceneWorld& built, const StepReport& report) { reports->write_step(t, scene, built, report); };
    }
    RunResult result;
    {
        Progress progress(!arguments.quiet);
        result = run_scene(
            scene, options, on_sample, [&](long done, long all) { progress.update(done, all); }, on_report);
    }
    if (states) states->finish();
    if (reports) reports->finish();
    if (arguments.json) {
        fmt::print("{}\n", runner_line(scene, result));
    } else if (!arguments.quiet) {
        fmt::print("{}", summary(scene, result));
    }
    return result.ok ? kSuccess : kRunFailed;
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("run", "Run a scene and tell how it went");
    const std::shared_ptr<Arguments> arguments = std::make_shared<Arguments>();
    command->add_option("SCENE", arguments->scene, "A scene file, or the name of a shipped scene (see: cairn list)")->required();
    add_run_options(*command, arguments->run);
    command->add_option("--states", arguments->states, "Write the sampled states of all moving bodies to this CSV file");
    command->add_option("--report", arguments->report,
                        "Write what each step tells about itself to this file: CSV, or lines of JSON if its name ends in .json or .jsonl");
    command->add_flag("--json", arguments->json, "Print one line of JSON instead of the summary");
    command->add_flag("--profile", arguments->profile, "Measure each stage of the step and count what it did");
    command->add_flag("--quiet", arguments->quiet, "Print neither summary nor progress");
    command->footer(
        "Examples:\n"
        "  cairn run stack_10\n"
        "  cairn run my_scene.json --dt 1/240 --substeps 8 --states my_states.csv\n"
        "  cairn run pyramid_10 --sleep 1 --json\n"
        "Exit codes: 0 well, 1 a body went non-finite, 2 bad arguments or files.");
    command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace cairn::cli
