// Instructions that a run of Cairn takes, counted by valgrind's callgrind: the same on a busy machine as on a quiet one.
#pragma once

#include "apps/cli/bench/plan.hpp"

namespace cairn::cli {

// Whether there is a valgrind to count with.
bool can_count_instructions();

// Of the steps alone, without the program's start and the reading of the scene. 0 if it does not end well, or if the program holds no names
// of functions (it was stripped). The case must be one of Cairn's.
double count_instructions(const BenchCase& c);

}  // namespace cairn::cli
