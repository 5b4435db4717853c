#include "apps/cli/commands.hpp"
#include "apps/cli/shipped_scenes.hpp"

#include "engine/scene/scene.hpp"

#include <fmt/format.h>

namespace cairn::cli {

namespace {

int list_scenes() {
    const std::vector<std::string> names = shipped_scene_names();
    if (names.empty()) {
        fmt::print(stderr, "no scene files found: set CAIRN_SCENES to a folder of them\n");
        return kBadInput;
    }
    fmt::print("{:<16} {:>6} {:>6} {:>8}  {}\n", "scene", "bodies", "joints", "duration", "description");
    for (const std::string& name : names) {
        const Scene scene = load_scene(find_scene(name));
        fmt::print("{:<16} {:>6} {:>6} {:>6.3g} s  {}\n", name, scene.bodies.size(), scene.joints.size(), scene.duration,
                   scene.description);
    }
    return kSuccess;
}

}  // namespace

void add_list_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("list", "List the shipped scenes");
    command->footer(
        "They are looked for in the folder CAIRN_SCENES of the environment, in the installed share/cairn/scenes, and in the source tree.");
    command->callback([&exit_code] { exit_code = list_scenes(); });
}

}  // namespace cairn::cli
