#include "apps/cli/commands.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <string>

namespace {

using namespace cairn::cli;

bool is_command(const CLI::App& app, const std::string& name) {
    const auto has_name = [&name](const CLI::App* command) { return command->get_name() == name; };
    return !app.get_subcommands(has_name).empty();
}

int run_command_line(int argc, char** argv) {
    int exit_code = kSuccess;
    CLI::App app{"Cairn: 3D rigid-body physics", "cairn"};
    app.require_subcommand(1);
    app.footer("cairn COMMAND --help explains a command.\nExit codes: 0 well, 1 the run reported a failure, 2 bad input.");
    add_run_command(app, exit_code);
    add_list_command(app, exit_code);
    add_scenes_command(app, exit_code);
    add_bench_command(app, exit_code);
    add_stress_command(app, exit_code);
    add_diagnose_command(app, exit_code);
    add_report_command(app, exit_code);
    add_study_command(app, exit_code);
    // Said here because the parser would only say that a command is missing.
    if (argc > 1 && argv[1][0] != '-' && !is_command(app, argv[1])) {
        fmt::print(stderr, "{}: unknown command, known are run, list, scenes, bench, stress, diagnose, report, study\n", argv[1]);
        return kBadInput;
    }
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? kSuccess : kBadInput;
    }
    return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run_command_line(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return kBadInput;
    }
}
