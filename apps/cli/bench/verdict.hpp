// What a benchmark says of the engines against one another; losses first.
#pragma once

#include "apps/cli/bench/results.hpp"

namespace cairn::cli {

// Name of a line in plots and tables: the engine, with Cairn's solver where it is not chosen automatically.
std::string label_of(const BenchRow& row);

// A row's id without what it says of one key, as "threads" in "… threads=2 …".
std::string id_without(const BenchRow& row, const std::string& key);

// Where another engine is faster and no less accurate than Cairn at the same step, or holds where Cairn fails: a sentence for each engine.
std::vector<std::string> wins_of_others(const std::vector<BenchRow>& rows);

// Where another engine is faster than Cairn at the same step, at whatever error: a sentence for each engine.
std::vector<std::string> faster_others(const std::vector<BenchRow>& rows);

// A run of another engine that is as accurate in less time than Cairn takes for that at any step.
struct Lead {
    const BenchRow* row = nullptr;
    double factor = 0;      // Cairn's time for that error over the run's: along the line through its runs, logarithmic; infinite: never
    bool cheapest = false;  // the run is even quicker than Cairn's quickest, which is more accurate: there is no line to compare with
};
// Of one scene, in order of time. Errors under 1e-9 count as that. Only runs that count, and only if Cairn has one.
std::vector<Lead> leads_of_others(const std::vector<BenchRow>& rows, const std::string& scene);
// A sentence for each scene that Cairn and others have run at three steps and more.
std::vector<std::string> curves_compared(const std::vector<BenchRow>& rows);

// Rows of one scene that no other row of it beats in both time and error, in order of time. Only runs that count.
std::vector<const BenchRow*> pareto_front(const std::vector<BenchRow>& rows, const std::string& scene);

// Of how many scenes each label has a point on the front; those with the most first.
std::vector<std::pair<std::string, int>> front_counts(const std::vector<BenchRow>& rows);

// Names of the scenes, in the order of their first rows.
std::vector<std::string> scenes_of(const std::vector<BenchRow>& rows);
std::vector<std::string> labels_of(const std::vector<BenchRow>& rows);

}  // namespace cairn::cli
