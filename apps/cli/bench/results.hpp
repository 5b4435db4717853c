// Results of a benchmark: what one run gave, what a case gave over its repeats, and the files they are kept in.
#pragma once

#include "apps/cli/bench/machine.hpp"
#include "apps/cli/bench/plan.hpp"

#include <map>
#include <string>
#include <vector>

namespace cairn::cli {

// One case over all its repeats. Text and numbers as they go into the files.
struct BenchRow {
    std::string id, command;
    int place = 0;  // in the plan: rows of shards are put back into its order
    std::string scene, engine, version, solver, dt_text, settings;
    int bodies = 0, precision = 64;
    double dt = 0;                     // [s]
    int substeps = 0, iterations = 0;  // 0: the engine's default
    int threads = 1;
    std::string status, note;         // ok, failed (of whatever kind), unsupported, crashed, timeout
    std::string truth, metric, unit;  // kind of truth, what the error is of, its unit
    double error = 0;                 // NaN: none
    std::string path_metric;          // where the truth is an invariant and the true way is known too: what `path_error` is of
    double path_error = 0;            // relative; NaN: none
    double energy_gain = 0;           // relative to the scene's scale
    long steps = 0;
    int contacts = 0;
    std::vector<double> walls;         // [s] in the engine's steps, one a repeat
    std::vector<double> step_medians;  // [s]
    std::vector<double> phases;        // [s] of one more run with the engine's clock on, by Phase, and the rest; empty: not measured
    double instructions = 0;           // of the steps of one run, counted by callgrind; 0: not counted
    std::string state_hash;            // of the first repeat
    bool same_states = true;           // of all repeats

    double wall_median() const;  // [s]; 0 without a run
    double step_median() const;  // [s]
    double spread() const;       // (largest − smallest) / median of the repeats' times
};

// Runs a case once and adds what it gave to its row.
void run_case(const BenchCase& c, double timeout, BenchRow& row);

// One more run with the engine's own clock on, which costs time itself: fills `phases` alone.
void measure_phases(const BenchCase& c, double timeout, BenchRow& row);

// A folder of results: rows.jsonl (a line after each run, so that a broken benchmark goes on where it stopped), results.csv, results.json.
class ResultFolder {
public:
    // Makes the folder, or reads what is there. Throws Error if it holds results of another commit or machine, unless `mixed` says that
    // this is fine. An empty path keeps nothing.
    ResultFolder(const std::string& path, const Machine& machine, bool mixed);

    // Repeats of a case that are there already.
    int done(const std::string& id) const;
    BenchRow& row(const std::string& id);
    void keep(const BenchRow& row);                            // after each run
    void finish(const std::vector<std::string>& order) const;  // writes the CSV and the JSON, rows in this order

private:
    std::string path_;
    Machine machine_;
    std::map<std::string, BenchRow> rows_;
};

// Rows and machines of every rows.jsonl in a folder and the folders in it (the parts of a sharded benchmark, or one that was broken off),
// in the order of the plan. Throws Error if there are none.
std::vector<BenchRow> read_results(const std::string& folder, std::vector<Machine>& machines);
std::vector<BenchRow> read_result_file(const std::string& path, Machine& machine);

}  // namespace cairn::cli
