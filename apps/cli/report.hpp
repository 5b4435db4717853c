// What a run tells: one JSON line for programs, a summary for people.
#pragma once

#include "apps/cli/runner.hpp"

#include <string>
#include <vector>

namespace cairn::cli {

// The runner line of docs/formats.md, without the line break.
std::string runner_line(const Scene& scene, const RunResult& result);

std::string summary(const Scene& scene, const RunResult& result);

// Sentences about what a user should look at; empty if there is nothing.
std::vector<std::string> warnings(const Scene& scene, const RunResult& result);

// A time with a unit that fits, as in "12.3 µs".
std::string readable_time(double seconds);

}  // namespace cairn::cli
