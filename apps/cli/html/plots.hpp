// Plots of results, drawn by gnuplot.
#pragma once

#include "apps/cli/bench/results.hpp"
#include "apps/cli/stress/stress_file.hpp"

#include <map>
#include <string>
#include <vector>

namespace cairn::cli {

// Whether there is a gnuplot to draw with.
bool can_plot();

// Scripts: each sets everything but the terminal and the output.
//   work-precision  a scene's error over the time of a run, both logarithmic; a line for each engine or solver; the Pareto front marked
//   scaling         time of a step over bodies
//   threads         speed-up over Cairn's threads, of the scenes with the longest steps; empty without runs on several
//   stress          the share of each ladder that is held
std::string work_precision_script(const std::vector<BenchRow>& rows, const std::string& scene, const std::vector<std::string>& labels);
std::string scaling_script(const std::vector<BenchRow>& rows, const std::vector<std::string>& labels);
std::string threads_script(const std::vector<BenchRow>& rows);
std::string stress_script(const std::vector<StressRow>& rows);

struct Size {
    int width = 480, height = 340;  // [px]
};
// Runs gnuplot once over all scripts. Returns SVG for each name, in colours of the page that it is put into (currentColor for lines and
// text). Throws Error if gnuplot fails.
std::map<std::string, std::string> draw_svg(const std::map<std::string, std::pair<std::string, Size>>& scripts);
// The same into files, `folder`/NAME.svg and NAME.png, on white.
void draw_files(const std::map<std::string, std::pair<std::string, Size>>& scripts, const std::string& folder);

}  // namespace cairn::cli
