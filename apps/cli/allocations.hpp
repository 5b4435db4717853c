// Counts the program's allocations through operator new, which this replaces: a step that has warmed up makes none.
#pragma once

#include <cstdint>

namespace cairn::cli {

// Since the program began, on all threads.
std::uint64_t allocations_so_far();

}  // namespace cairn::cli
