#include "apps/cli/commands.hpp"

#include <exception>
#include <iostream>

int main(int argc, char** argv) {
    using namespace cairn::cli;
    int exit_code = kSuccess;
    try {
        CLI::App app{"Cairn: 3D rigid-body physics", "cairn"};
        app.require_subcommand(1);
        app.footer(
            "cairn COMMAND --help explains a command.\nExit codes: 0 well, 1 the run reported a failure, 2 bad input, 3 unsupported.");
        add_run_command(app, exit_code);
        add_list_command(app, exit_code);
        add_scenes_command(app, exit_code);
        add_bench_command(app, exit_code);
        try {
            app.parse(argc, argv);
        } catch (const CLI::ParseError& error) {
            return app.exit(error) == 0 ? kSuccess : kBadInput;
        }
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return kBadInput;
    }
    return exit_code;
}
