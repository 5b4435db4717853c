#include "apps/cli/states_file.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <iterator>
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

StatesFile::StatesFile(const std::string& path) : path_(path), target_(path) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::is_directory(target_, ignored)) throw Error("--states: " + path + ": is a folder, must be a file");
    if (const int descriptor = open_descriptor(path); descriptor >= 0) {
        // Through the same open file: one position in it for the states and for what else is printed there.
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
    write("t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n");
}

StatesFile::~StatesFile() {
    if (file_ != nullptr) std::fclose(file_);
    if (!temporary_.empty()) std::remove(temporary_.c_str());
}

void StatesFile::write_sample(Real t, const Scene& scene, const SceneWorld& built) {
    rows_.clear();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (scene.bodies[i].type == BodyType::kStatic) continue;
        const BodyState s = built.world.state(built.ids[i]);
        fmt::format_to(std::back_inserter(rows_), "{:.17g},{}", t, scene.bodies[i].name);
        for (const Real x : {s.position.x(), s.position.y(), s.position.z(), s.rotation.w(), s.rotation.x(), s.rotation.y(), s.rotation.z(),
                             s.linear_velocity.x(), s.linear_velocity.y(), s.linear_velocity.z(), s.angular_velocity.x(),
                             s.angular_velocity.y(), s.angular_velocity.z()}) {
            fmt::format_to(std::back_inserter(rows_), ",{:.17g}", x);
        }
        rows_ += '\n';
    }
    write(rows_);
}

void StatesFile::finish() {
    std::FILE* file = std::exchange(file_, nullptr);
    if (std::fclose(file) != 0) fail("cannot be written");
    if (temporary_.empty()) return;
    if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail("cannot be written");
    temporary_.clear();
}

void StatesFile::write(const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail("cannot be written");
}

void StatesFile::fail(const char* what) const {
    throw Error("--states: " + path_ + ": " + what + ": " + std::strerror(errno));
}

}  // namespace cairn::cli
