// What a benchmark says of the engines against one another; losses first.
#pragma once

#include "apps/cli/bench/results.hpp"

namespace cairn::cli {

// Name of a line in plots and tables: the engine, with Cairn's solver where it is not chosen automatically.
std::string label_of(const BenchRow& row);

// Where another engine is faster and no less accurate than Cairn at the same step, or holds where Cairn fails: a sentence for each engine.
std::vector<std::string> wins_of_others(const std::vector<BenchRow>& rows);

// Where another engine is faster than Cairn at the same step, at whatever error: a sentence for each engine.
std::vector<std::string> faster_others(const std::vector<BenchRow>& rows);

// Rows of one scene that no other row of it beats in both time and error, in order of time. Only runs that count.
std::vector<const BenchRow*> pareto_front(const std::vector<BenchRow>& rows, const std::string& scene);

// Of how many scenes each label has a point on the front; those with the most first.
std::vector<std::pair<std::string, int>> front_counts(const std::vector<BenchRow>& rows);

// Names of the scenes, in the order of their first rows.
std::vector<std::string> scenes_of(const std::vector<BenchRow>& rows);
std::vector<std::string> labels_of(const std::vector<BenchRow>& rows);

}  // namespace cairn::cli
