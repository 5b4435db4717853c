#include "apps/cli/output_file.hpp"

#include "engine/base/error.hpp"

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <utility>

namespace cairn::cli {

namespace {

// The number of the open file that a path such as /dev/stdout or /dev/fd/3 stands for, or -1.
int open_descriptor(const std::string& path) {
    if (path == "/dev/stdout") return STDOUT_FILENO;
    if (path == "/dev/stderr") return STDERR_FILENO;
    for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
        if (path.compare(0, folder.size(), folder) != 0) continue;
        int number = -1;
        const std::from_chars_result read = std::from_chars(path.data() + folder.size(), path.data() + path.size(), number);
        if (read.ec == std::errc() && read.ptr == path.data() + path.size()) return number;
    }
    return -1;
}

}  // namespace

OutputFile::OutputFile(const std::string& option, const std::string& path) : name_(option + ": " + path + ": "), target_(path) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::is_directory(target_, ignored)) throw Error(name_ + "is a folder, must be a file");
    if (const int descriptor = open_descriptor(path); descriptor >= 0) {
        // Through the same open file: one position in it for this and for what else is printed there.
        const int copy = ::dup(descriptor);
        file_ = copy < 0 ? nullptr : ::fdopen(copy, "wb");
    } else if (fs::exists(target_, ignored) && !fs::is_regular_file(target_, ignored)) {
        file_ = std::fopen(target_.c_str(), "wb");
    } else {
        // Renaming replaces what has the name: a link's target, not the link.
        if (fs::is_symlink(fs::symlink_status(target_, ignored)) && fs::exists(target_, ignored))
            target_ = fs::canonical(target_, ignored).string();
        temporary_ = target_ + ".part" + std::to_string(::getpid());
        file_ = std::fopen(temporary_.c_str(), "wb");
    }
    if (file_ == nullptr) {
        temporary_.clear();
        fail("cannot be opened for writing");
    }
}

OutputFile::~OutputFile() {
    if (file_ != nullptr) std::fclose(file_);
    if (!temporary_.empty()) std::remove(temporary_.c_str());
}

void OutputFile::finish() {
    std::FILE* file = std::exchange(file_, nullptr);
    if (std::fclose(file) != 0) fail("cannot be written");
    if (temporary_.empty()) return;
    if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail("cannot be written");
    temporary_.clear();
}

void OutputFile::write(const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail("cannot be written");
}

void OutputFile::fail(const char* what) const {
    throw Error(name_ + what + ": " + std::strerror(errno));
}

}  // namespace cairn::cli
