// Counts heap allocations of the whole program, to prove that a warmed-up step makes none:
//
//     const std::uint64_t before = allocation_count::count();
//     world.step(dt);
//     CHECK(allocation_count::count() == before);
//
// Counts what reaches the C library (malloc, calloc, realloc, aligned_alloc, posix_memalign), so operator new, Eigen, FCL and libccd are
// all seen, on every thread. Works by defining these functions in the program itself, which GNU's C library allows; link
// cairn_test_allocation.
#pragma once

#include <cstdint>

namespace allocation_count {

// False under a sanitizer (which brings its own malloc) and on other C libraries: count() stays 0 and the test has nothing to check.
bool available();

// Allocations since the program began. Never allocates.
std::uint64_t count();

}  // namespace allocation_count
