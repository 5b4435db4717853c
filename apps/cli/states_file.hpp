// States file: CSV, a row for each dynamic or kinematic body and sample (docs/formats.md).
#pragma once

#include "engine/scene/scene.hpp"

#include <cstdio>
#include <memory>
#include <string>

namespace cairn::cli {

// Writes to PATH.partPID and renames at the end, so that a file by this name is always whole. What is no regular file (a device, a pipe,
// /dev/stdout and the like) is written to directly and never renamed over.
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
