// Where the shipped scene files are.
#pragma once

#include <string>
#include <vector>

namespace cairn::cli {

// Folders that are looked into, in this order: CAIRN_SCENES of the environment, or else the installed share/cairn/scenes beside this
// program, or else the source tree it was built from. The first that exists.
std::string shipped_scene_folder();

// Names of the shipped scenes, in order; empty if there is no folder.
std::vector<std::string> shipped_scene_names();

// The path of a scene given as a file or as the name of a shipped scene. Throws Error if it is neither.
std::string find_scene(const std::string& file_or_name);

}  // namespace cairn::cli
