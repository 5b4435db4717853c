// Engines outside this program: processes that read a scene file and write states (docs/formats.md, the runner line).
#pragma once

#include "apps/cli/engine_run.hpp"

#include <string>

namespace cairn::cli {

// Runs inside the child process of run_engine. Throws Error, or Unsupported.
void run_external(const EngineChoice& engine, const SceneFile& file, const EngineSettings& settings, EngineRun& run);

// Reads a states file; bodies that it does not name keep their start, times ascend. Throws Error with the line that cannot be read.
History read_states(const std::string& text, const Scene& scene);

}  // namespace cairn::cli
