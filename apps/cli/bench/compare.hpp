// A benchmark against an older one: what got less accurate, and what got slower.
#pragma once

#include "apps/cli/bench/results.hpp"

namespace cairn::cli {

struct CompareLimits {
    double accuracy = 0.05;      // an error may grow by this share …
    double floor = 1e-9;         // … or by this much, in its unit: below it is rounding
    double instructions = 0.02;  // an instruction count may grow by this share; where both have one, times are not looked at
    double time = 0.10;          // a median time may grow by this share, or by the spread of both
};

struct Comparison {
    int compared = 0;
    int other_settings = 0;           // of them, cases that the older results have with other settings only
    std::vector<std::string> worse;   // sentences: errors that grew, runs that failed and did not before
    std::vector<std::string> better;  // errors that shrank by as much
    std::vector<std::string>
        slower;  // instruction counts where both have them; else times, which mean little unless one quiet machine measured both
};
// Cases are matched by all that they ask for; one that the older results do not have, with the only one of the same scene, engine and step.
Comparison compare_results(const std::vector<BenchRow>& before, const std::vector<BenchRow>& now, const CompareLimits& limits);

}  // namespace cairn::cli
