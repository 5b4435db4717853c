// How fast an error falls with the step: the order of convergence p in error ~ dtᵖ, as it is measured.
#pragma once

#include "apps/cli/bench/results.hpp"

namespace cairn::cli {

// Errors below this are as good as none: the references are good to some 1e-12, and states carry rounding of 1e-11 after thousands of
// steps.
constexpr double kOrderFloor = 1e-10;

// Of one engine (with one choice of everything but the step) on one scene.
struct Order {
    std::string scene, label, metric;
    std::string series;            // as series_of()
    double order = 0;              // slope of log error over log dt, least squares over the steps named below; NaN: none
    double overall = 0;            // the same over all steps whose error is above the floor, falling or not; NaN: fewer than two
    int steps = 0;                 // that `order` is from
    std::string coarsest, finest;  // of them
    std::string note;              // what is beyond them, or why there is no order
};

// Names everything that a case asks for but its step.
std::string series_of(const BenchRow& row);

// For each series of at least three steps. `order` is over the longest run of neighbouring steps that are above the floor and along which
// the error falls, each time at least as dt^½: three steps, or two if the next is at the floor. Coarse steps at its begin are dropped if
// that leaves a straight line (each two neighbours within ½ of its slope) of three steps or more. What failed is left out, and so are
// invariants, which hold on any way.
std::vector<Order> orders_of(const std::vector<BenchRow>& rows);

// "4.0 over 1/60 … 1/960, then at the floor"
std::string to_text(const Order& order);

// The rows, and after them those of paths: rows that have one, with the path's error in place of the invariant's and " path" behind the
// scene's name.
std::vector<BenchRow> with_paths(const std::vector<BenchRow>& rows);

}  // namespace cairn::cli
