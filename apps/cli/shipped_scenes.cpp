#include "apps/cli/shipped_scenes.hpp"

#include "engine/base/error.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace cairn::cli {

namespace fs = std::filesystem;

std::string shipped_scene_folder() {
    std::error_code ignored;
    if (const char* given = std::getenv("CAIRN_SCENES"); given != nullptr && given[0] != '\0') {
        if (!fs::is_directory(given, ignored)) throw_invalid("CAIRN_SCENES", std::string(given), "a folder of scene files");
        return given;
    }
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    for (const fs::path& folder :
         {program.parent_path().parent_path() / CAIRN_DATA_FOLDER / "cairn" / "scenes", fs::path(CAIRN_SOURCE_SCENES)}) {
        if (fs::is_directory(folder, ignored)) return folder.string();
    }
    return {};
}

std::vector<std::string> shipped_scene_names() {
    std::vector<std::string> names;
    const std::string folder = shipped_scene_folder();
    if (folder.empty()) return names;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

std::string find_scene(const std::string& file_or_name) {
    std::error_code ignored;
    if (fs::exists(file_or_name, ignored) && !fs::is_directory(file_or_name, ignored)) return file_or_name;
    const bool looks_like_file = file_or_name.find('/') != std::string::npos || fs::path(file_or_name).extension() == ".json";
    if (looks_like_file) return file_or_name;  // reading it says why it cannot be read
    const std::vector<std::string> names = shipped_scene_names();
    if (std::find(names.begin(), names.end(), file_or_name) != names.end())
        return (fs::path(shipped_scene_folder()) / (file_or_name + ".json")).string();
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    throw_invalid("scene", file_or_name, "a file or the name of a shipped scene (" + (list.empty() ? "none found" : list) + ")");
}

}  // namespace cairn::cli
