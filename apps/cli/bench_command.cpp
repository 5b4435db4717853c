#include "apps/cli/bench/compare.hpp"
#include "apps/cli/bench/instructions.hpp"
#include "apps/cli/bench/order.hpp"
#include "apps/cli/bench/verdict.hpp"
#include "apps/cli/commands.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/report.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace cairn::cli {

namespace {

struct Arguments {
    BenchRequest request;
    std::string out;
    std::string compare;
    CompareLimits limits;
    int repeats = 0;  // 0: as the size says
    double timeout = 120;
    int sleep = 0;
    bool mixed = false;
    bool instructions = false;
    bool profile = true;
};

int repeats_of(const Arguments& a) {
    if (a.repeats > 0) return a.repeats;
    return a.request.quick ? 3 : 5;
}

// One more run of each of Cairn's cases, under callgrind: what it counts does not depend on what else the machine does.
void count_all(const std::vector<BenchCase>& cases, ResultFolder& folder) {
    if (!can_count_instructions()) throw Error("--instructions: needs valgrind");
    Progress progress(true);
    for (std::size_t k = 0; k < cases.size(); ++k) {
        BenchRow& row = folder.row(cases[k].id());
        if (cases[k].engine.name == "cairn" && row.status != "unsupported" && row.instructions == 0) {
            row.instructions = count_instructions(cases[k]);
            folder.keep(row);
        }
        progress.update(static_cast<long>(k + 1), static_cast<long>(cases.size()));
    }
}

// One more run of each of Cairn's cases for the times of its stages: reading the clock takes time, so the other runs do without.
void profile_all(const std::vector<BenchCase>& cases, const Arguments& a, ResultFolder& folder) {
    Progress progress(true);
    for (std::size_t k = 0; k < cases.size(); ++k) {
        BenchRow& row = folder.row(cases[k].id());
        if (cases[k].engine.name == "cairn" && !row.walls.empty() && row.phases.empty()) {
            measure_phases(cases[k], a.timeout, row);
            folder.keep(row);
        }
        progress.update(static_cast<long>(k + 1), static_cast<long>(cases.size()));
    }
}

// Every case once, then every case again, so that a slow spell of the machine meets all engines alike.
void run_all(const std::vector<BenchCase>& cases, const Arguments& a, ResultFolder& folder) {
    double all = 0, done = 0;
    const int repeats = repeats_of(a);
    for (const BenchCase& c : cases) all += repeats * c.cost();
    Progress progress(true);
    for (int repeat = 0; repeat < repeats; ++repeat) {
        for (const BenchCase& c : cases) {
            if (folder.done(c.id()) <= repeat) {
                BenchRow& row = folder.row(c.id());
                run_case(c, a.timeout, row);
                folder.keep(row);
            }
            done += c.cost();
            progress.update(static_cast<long>(1e6 * done / all), 1'000'000);
        }
    }
}

void print_table(const std::vector<const BenchRow*>& rows) {
    fmt::print("{:<18} {:>6} {:<14} {:<7} {:>6} {:>4} {:>4} {:>3} {:>10} {:>6} {:>10}  {}\n", "scene", "bodies", "engine", "solver", "dt",
               "sub", "it", "thr", "per step", "spread", "error", "of");
    for (const BenchRow* r : rows) {
        const auto number = [](int x) { return x > 0 ? std::to_string(x) : std::string("-"); };
        const std::string error = std::isfinite(r->error) ? fmt::format("{:.2e}", r->error) : "-";
        const std::string of = r->metric + (r->unit.empty() || r->unit == "1" ? "" : " [" + r->unit + "]");
        const std::string note = r->status == "ok" ? of : fmt::format("{}: {}", r->status, r->note);
        fmt::print("{:<18} {:>6} {:<14} {:<7} {:>6} {:>4} {:>4} {:>3} {:>10} {:>5.0f}% {:>10}  {}\n", r->scene, r->bodies, r->engine,
                   r->solver, r->dt_text, number(r->substeps), number(r->iterations), r->threads,
                   r->walls.empty() ? "-" : readable_time(r->step_median()), 100 * r->spread(), error, note);
        if (!r->same_states) fmt::print("{:<18}   warning: its repeats did not have the same states\n", "");
    }
}

// Where there are three steps and more.
void print_orders(const std::vector<BenchRow>& rows) {
    const std::vector<Order> orders = orders_of(rows);
    if (orders.empty()) return;
    fmt::print("\norder of convergence p, error ~ dt^p (all: over all steps with an error above {:.0e})\n{:<18} {:<22} {:>6}  {}\n",
               kOrderFloor, "scene", "engine", "all", "where the error falls");
    for (const Order& o : orders) {
        fmt::print("{:<18} {:<22} {:>6}  {}\n", o.scene, o.label, std::isfinite(o.overall) ? fmt::format("{:.1f}", o.overall) : "-",
                   to_text(o));
    }
    fmt::print("\n");
}

void print_settings(const std::vector<const BenchRow*>& rows) {
    std::map<std::string, const BenchRow*> first;
    for (const BenchRow* r : rows) {
        if (r->settings.empty() || r->substeps != 0 || r->iterations != 0) continue;
        first.emplace(r->engine, r);
    }
    for (const auto& [engine, r] : first) fmt::print("{} {} ({} bits): {}\n", engine, r->version, r->precision, r->settings);
}

int print_comparison(const Arguments& a, const std::vector<BenchRow>& now) {
    Machine machine;
    const std::vector<BenchRow> before = read_result_file(a.compare, machine);
    const Comparison c = compare_results(before, now, a.limits);
    fmt::print("\nCompared with {} (commit {}, {}): {} cases\n", a.compare, machine.commit, machine.cpu, c.compared);
    if (c.other_settings > 0) fmt::print("{} of them have other settings there\n", c.other_settings);
    const auto list = [](const char* what, const std::vector<std::string>& lines) {
        if (!lines.empty()) fmt::print("{}:\n  {}\n", what, fmt::join(lines, "\n  "));
    };
    list("less accurate", c.worse);
    list("more accurate", c.better);
    list("slower", c.slower);
    if (c.compared == 0) throw Error("--compare: " + a.compare + ": has none of these cases");
    if (c.worse.empty()) fmt::print("none got less accurate by more than {:.0f} %\n", 100 * a.limits.accuracy);
    return c.worse.empty() ? kSuccess : kRunFailed;
}

int bench(Arguments& a) {
    if (a.request.quick && a.request.full) throw Error("--quick and --full: one of them");
    a.request.sleep = a.sleep == 1;
    const std::vector<BenchCase> cases = plan_cases(a.request);
    const Machine machine = this_machine();
    ResultFolder folder(a.out, machine, a.mixed);
    fmt::print("{} cases, {} repeats; {}, {} cores; {} {}; commit {}\n", cases.size(), repeats_of(a), machine.cpu, machine.cores,
               machine.compiler, machine.flags, machine.commit);
    std::fflush(stdout);
    run_all(cases, a, folder);
    if (a.profile) profile_all(cases, a, folder);
    if (a.instructions) count_all(cases, folder);
    std::vector<const BenchRow*> rows;
    std::vector<BenchRow> copies;
    std::vector<std::string> order;
    bool ok = true;
    for (const BenchCase& c : cases) {
        const BenchRow& row = folder.row(c.id());
        rows.push_back(&row);
        copies.push_back(row);
        order.push_back(row.id);
        const bool own_fault = row.engine == "cairn" && (row.status == "crashed" || row.status == "timeout" || !row.same_states);
        ok = ok && !own_fault;
    }
    folder.finish(order);
    for (const std::string& win : wins_of_others(copies)) fmt::print("{}\n", win);
    print_table(rows);
    print_orders(copies);
    for (const std::string& line : curves_compared(with_paths(copies))) fmt::print("{}\n", line);
    print_settings(rows);
    if (!a.out.empty()) fmt::print("results: {0}/results.csv, {0}/results.json; a page with plots: cairn report {0}\n", a.out);
    const int compared = a.compare.empty() ? static_cast<int>(kSuccess) : print_comparison(a, copies);
    return ok ? compared : static_cast<int>(kRunFailed);
}

void add_options(CLI::App& command, Arguments& a) {
    BenchRequest& r = a.request;
    command.add_option("--filter", r.filter, "Only scenes with this in their name");
    command.add_option("--scene", r.scenes, "This scene: a name or a file; may be given again")->allow_extra_args(false);
    command.add_option("--scenes", r.folder, "All scene files of this folder");
    command.add_flag("--quick", r.quick, "Only scenes of at most 30 bodies, two steps, 3 repeats: under a minute");
    command.add_flag("--full", r.full, "All solvers, five steps, several substeps and iterations: hours");
    command.add_flag("--work-precision", r.work_precision,
                     "Only the scenes whose truth is known to many digits, at steps of 1/30 to 1/1920: orders of convergence");
    command.add_option("--engines", r.engines,
                       fmt::format("List of engines (of {}), or none but those of --engine; default: cairn and the best of each",
                                   fmt::join(engine_names(), ", ")));
    command.add_option("--engine", r.external, "NAME=PATH of a program that follows the runner protocol; may be given again")
        ->allow_extra_args(false);
    command.add_option("--dt", r.dt, "List of steps [s], as in 1/60,1/240");
    command.add_option("--substeps", r.substeps, "List of substeps of a step; `default`: the engine's own");
    command.add_option("--iterations", r.iterations, "List of most sweeps of a solve; `default`: the engine's own");
    command.add_option("--solver", r.solvers, "List of Cairn's solvers: " + solver_names());
    command.add_option("--residual-tolerance", r.residual_tolerances, "List of tolerances of Cairn's solves [m/s]");
    command.add_option("--tolerance", r.tolerances, "List of position errors that Cairn admits per simulated second [m/s]");
    command.add_option("--threads", r.threads, "List of numbers of Cairn's threads, as in 1,2; default 1. The others run on one");
    command.add_option("--sleep", a.sleep, "1: bodies at rest fall asleep, in every engine")
        ->check(CLI::Range(0, 1))
        ->capture_default_str();
    command.add_option("--repeats", a.repeats, "Runs of each case, in turn; default 5, with --quick 3")->check(CLI::Range(1, 1000));
    command.add_option("--timeout", a.timeout, "Longest run [s]")->check(CLI::PositiveNumber)->capture_default_str();
    command.add_option("--out", a.out, "Folder for results; a broken benchmark goes on where it stopped");
    command.add_flag("--mixed", a.mixed, "Add to results of another commit or machine");
    command.add_option("--shard", r.shard, "I/N: the I-th part of N; cairn report merges the folders");
    command.add_flag("!--no-profile", a.profile, "Leave out the run that measures the stages of Cairn's step");
    command.add_flag("--instructions", a.instructions, "Also count Cairn's instructions, by valgrind's callgrind: some 50 times as slow");
    command.add_option("--compare", a.compare, "results.json of an older benchmark; fails if something got less accurate");
    command.add_option("--threshold", a.limits.accuracy, "Share by which an error may grow")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
}

}  // namespace

void add_bench_command(CLI::App& app, int& exit_code) {
    CLI::App* command =
        app.add_subcommand("bench", "Run time against error: scenes, engines, solvers and steps, against what is known of each scene");
    const std::shared_ptr<Arguments> arguments = std::make_shared<Arguments>();
    add_options(*command, *arguments);
    command->footer(
        "per step: median time of a step, and over repeats.  spread: of the repeats' total times.  error: against a closed form, a "
        "reference\n"
        "integrated beside the run, or what every exact motion keeps (docs/benchmarks.md); relative where no unit is given.\n"
        "Examples:\n"
        "  cairn bench --quick\n"
        "  cairn bench --filter slide --dt 1/60,1/120,1/240 --engines cairn,bullet64\n"
        "  cairn bench --work-precision --out results\n"
        "  cairn bench --full --out results --shard 3/8");
    command->callback([arguments, &exit_code] { exit_code = bench(*arguments); });
}

}  // namespace cairn::cli
