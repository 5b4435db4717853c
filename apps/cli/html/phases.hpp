// Where the time of Cairn's steps goes, as bars in the page.
#pragma once

#include "apps/cli/bench/results.hpp"

#include <string>
#include <vector>

namespace cairn::cli {

// A legend and a bar for each scene (and number of threads), split by the stages of the step: of the rows at a step of 1/60 s with every
// default. Empty if no row has phases.
std::string phase_bars(const std::vector<BenchRow>& rows);

}  // namespace cairn::cli
