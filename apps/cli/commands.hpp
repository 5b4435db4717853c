// The subcommands of `cairn`. Each adds itself to the command line; when it is chosen it runs and sets the exit code:
// 0 all went well, 1 the run reported a failure, 2 bad input (arguments or files), 3 the scene asks for what this engine lacks.
#pragma once

#include <CLI/CLI.hpp>

namespace cairn::cli {

enum ExitCode : int { kSuccess = 0, kRunFailed = 1, kBadInput = 2 };

void add_run_command(CLI::App& app, int& exit_code);
void add_list_command(CLI::App& app, int& exit_code);
void add_scenes_command(CLI::App& app, int& exit_code);
void add_bench_command(CLI::App& app, int& exit_code);
void add_stress_command(CLI::App& app, int& exit_code);
void add_diagnose_command(CLI::App& app, int& exit_code);
void add_report_command(CLI::App& app, int& exit_code);
void add_study_command(CLI::App& app, int& exit_code);

}  // namespace cairn::cli
