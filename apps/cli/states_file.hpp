// States file: CSV, a row for each dynamic or kinematic body and sample (docs/formats.md).
#pragma once

#include "engine/scene/scene.hpp"

#include <cstdio>
#include <memory>
#include <string>

namespace cairn::cli {

// Writes beside the file and renames at the end, so that a file by this name is always whole; a device or pipe is written to directly.
class StatesFile {
public:
    // Throws Error if it cannot be opened for writing.
    explicit StatesFile(const std::string& path);
    ~StatesFile();  // without finish(): what was written is removed
    StatesFile(const StatesFile&) = delete;
    StatesFile& operator=(const StatesFile&) = delete;

    // One row for each body of the scene that can move. Throws Error when writing fails.
    void write_sample(Real t, const Scene& scene, const SceneWorld& built);
    // Throws Error when the file could not be written whole.
    void finish();

private:
    void write(const std::string& text);
    [[noreturn]] void fail(const char* what) const;

    std::string path_;       // as given, for messages
    std::string target_;     // what it names, symbolic links followed
    std::string temporary_;  // empty: written to directly
    std::FILE* file_ = nullptr;
    std::string rows_;
};

}  // namespace cairn::cli
