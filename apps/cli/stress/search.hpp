// Finds the highest rung that an engine holds: bisection, so that it costs log₂ of the ladder.
#pragma once

#include "apps/cli/stress/limit.hpp"

#include <functional>
#include <string>
#include <vector>

namespace cairn::cli {

// One engine (with one of its solvers) at one limit.
struct LimitResult {
    std::string limit, engine, solver;
    int held = -1;  // index of the highest rung that passed below all that failed; −1: not even the first
    int rungs = 0;
    double value = 0;                          // that rung; 0 if none
    std::string failed_at;                     // why the next rung does not pass; empty: the ladder ends
    double failed_value = 0;                   // the next rung
    std::string held_command, failed_command;  // runs that show it
    std::string note;                          // "unsupported: …": not searched
};

// Highest rung that passes, and the reason of the one above. `passes` gives the reason for failing, or nothing. Takes it that what holds a
// rung holds all easier ones. `reason` becomes the reason of rung held + 1.
int highest_passing(int rungs, const std::function<std::string(int)>& passes, std::string& reason);

struct StressSettings {
    EngineSettings engine;  // its dt is the limit's
    bool quick = false;
    double timeout = 60;       // [s] of a run; a run that takes longer has failed
    std::string scene_folder;  // where the scenes of the result are kept; empty: nowhere
};
LimitResult search_limit(const Limit& limit, const EngineChoice& engine, const StressSettings& settings);

}  // namespace cairn::cli
