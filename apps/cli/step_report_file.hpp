// Report file: what each step tells about itself (docs/formats.md).
#pragma once

#include "apps/cli/output_file.hpp"
#include "engine/scene/scene.hpp"

#include <string>

namespace cairn::cli {

// CSV, a row a step; or, if the path ends in .json or .jsonl, a line of JSON a step, which holds the islands as well.
class StepReportFile {
public:
    // Throws Error if it cannot be opened for writing.
    explicit StepReportFile(const std::string& path);

    // `report` must have diagnostics. Throws Error when writing fails.
    void write_step(Real t, const Scene& scene, const SceneWorld& built, const StepReport& report);
    // Throws Error when the file could not be written whole.
    void finish() { file_.finish(); }

private:
    OutputFile file_;
    bool json_;
    std::string row_;
};

// The name of a body in the scene; empty for the world.
std::string body_name(const World& world, BodyId body);
// As "ball joint of a and b"; empty if there is none.
std::string joint_name(const Scene& scene, const JointId& joint);

}  // namespace cairn::cli
