// A file that a run writes as it goes.
#pragma once

#include <cstdio>
#include <string>

namespace cairn::cli {

// Writes to PATH.partPID and renames at the end, so that a file by this name is always whole. What is no regular file (a device, a pipe,
// /dev/stdout and the like) is written to directly and never renamed over.
class OutputFile {
public:
    // Throws Error if it cannot be opened for writing; `option` names it in messages.
    OutputFile(const std::string& option, const std::string& path);
    ~OutputFile();  // without finish(): what was written is removed
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    // Throws Error when writing fails.
    void write(const std::string& text);
    // Throws Error when the file could not be written whole.
    void finish();

private:
    [[noreturn]] void fail(const char* what) const;

    std::string name_;       // for messages: option and path as given
    std::string target_;     // what it names, symbolic links followed
    std::string temporary_;  // empty: written to directly
    std::FILE* file_ = nullptr;
};

}  // namespace cairn::cli
