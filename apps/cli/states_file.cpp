#include "apps/cli/states_file.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <utility>

namespace cairn::cli {

StatesFile::StatesFile(const std::string& path) : path_(path), target_(path) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::is_directory(target_, ignored)) throw Error("--states: " + path + ": is a folder, must be a file");
    // Renaming replaces what has the name: a link's target, not the link, and never a device.
    if (fs::is_symlink(fs::symlink_status(target_, ignored)) && fs::exists(target_, ignored))
        target_ = fs::canonical(target_, ignored).string();
    const bool direct = fs::exists(target_, ignored) && !fs::is_regular_file(target_, ignored);
    if (!direct) temporary_ = target_ + ".part" + std::to_string(::getpid());
    file_ = std::fopen(direct ? target_.c_str() : temporary_.c_str(), "wb");
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
