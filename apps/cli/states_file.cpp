#include "apps/cli/states_file.hpp"

#include <fmt/format.h>

#include <iterator>

namespace cairn::cli {

StatesFile::StatesFile(const std::string& path) : file_("--states", path) {
    file_.write("t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n");
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
    file_.write(rows_);
}

}  // namespace cairn::cli
