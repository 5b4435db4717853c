// States file: CSV, a row for each dynamic or kinematic body and sample (docs/formats.md).
#pragma once

#include "apps/cli/output_file.hpp"
#include "engine/scene/scene.hpp"

#include <string>

namespace cairn::cli {

class StatesFile {
public:
    // Throws Error if it cannot be opened for writing.
    explicit StatesFile(const std::string& path);

    // One row for each body of the scene that can move. Throws Error when writing fails.
    void write_sample(Real t, const Scene& scene, const SceneWorld& built);
    // Throws Error when the file could not be written whole.
    void finish() { file_.finish(); }

private:
    OutputFile file_;
    std::string rows_;
};

}  // namespace cairn::cli
