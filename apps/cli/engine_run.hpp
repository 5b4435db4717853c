// Runs one scene in one engine, whichever it is, and hands back its sampled states and times. The engine runs in a process of its own, so
// that a crash or an endless step of it is a result like any other.
#pragma once

#include "apps/cli/engines.hpp"
#include "apps/cli/truths.hpp"

#include <cstdint>
#include <string>

namespace cairn::cli {

// An engine of engine_names(), or an external program that follows the runner protocol (docs/formats.md).
struct EngineChoice {
    std::string name;
    std::string path;  // of the external runner; empty: built in
};

// A comma-separated list of names, as in "cairn,bullet64,ode", and NAME=PATH for each external runner. Throws Error on an unknown name.
std::vector<EngineChoice> parse_engines(const std::string& names, const std::vector<std::string>& external);

enum class RunStatus : std::uint8_t {
    kOk,
    kUnsupported,  // the scene or the settings ask for what the engine lacks
    kFailed,       // the engine gave up, or ended without its states
    kCrashed,
    kTimeout,
};
const char* to_string(RunStatus status);

struct EngineRun {
    RunStatus status = RunStatus::kOk;
    std::string note;  // why it is not kOk
    std::string version;
    std::string settings;  // in words
    int precision = 64;
    long steps = 0;
    // Time inside the engine's own step calls [s].
    double wall_total = 0;
    double wall_median_step = 0;
    double wall_max_step = 0;
    std::vector<double> phases;    // [s] in each of phase_keys(), if asked for and measured
    int contacts_max = 0;          // −1: not told
    std::uint64_t state_hash = 0;  // of all samples: equal for bitwise equal runs
    History history;
};

// A scene with the file that external runners read: its path, or its text if it has none yet.
struct SceneFile {
    Scene scene;
    std::string path;
    std::string text;
};

// `timeout` [s] of the whole run. Never throws for what the engine does; throws Error if no process or pipe can be made.
EngineRun run_engine(const EngineChoice& engine, const SceneFile& file, const EngineSettings& settings, double timeout);

}  // namespace cairn::cli
