// Runs the built program as a user does.
#pragma once

#include <string>

// A folder of its own, removed at the end.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    std::string file(const std::string& name) const { return path_ + "/" + name; }
    const std::string& path() const { return path_; }

private:
    std::string path_;
};

struct ProgramResult {
    int exit_code = -1;
    std::string out;
    std::string err;
    std::string last_line() const;  // of out
};

// `arguments` as in a shell; `environment` before the program's name, as in "CAIRN_SCENES=/x".
ProgramResult run_cairn(const std::string& arguments, const std::string& environment = "");

std::string read_text(const std::string& path);
void write_text(const std::string& path, const std::string& text);
