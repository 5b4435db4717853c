// Speed and spin.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"
#include "apps/cli/truth_parts.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

namespace {

std::string shot(double speed, bool) {
    SceneWriter scene("tunnel", "A small ball flies at a thin wall", std::max(0.1, 8 / speed), 1.0 / 60);
    scene.gravity(Vec3::Zero());
    scene.fixed("wall", Vec3::Zero(), box_shape({0.02, 4, 4}));
    // Started where steps of 1/60 s end before and behind the wall, and not in it.
    const Real step = speed / 60, start = -(std::ceil(2 / step) + 0.5) * step;
    scene.dynamic("ball", 0.1, {start, 0.1, 0.2}, sphere_shape(0.05))["linear_velocity"] = {speed, 0, 0};
    return scene.text();
}
std::string stopped(const Scene& scene, const EngineRun& run) {
    return passed_wall(scene, run.history).value == 0 ? std::string() : std::string("it passed the wall");
}

// Spin about the middle axis of a box in free space, a little off: the case that turns over and over.
std::string spinner(double rate, bool) {
    SceneWriter scene("torque_free", "A box spins about its middle axis in free space", 1, 1.0 / 60);
    scene.gravity(Vec3::Zero());
    scene.dynamic("box", 1, Vec3::Zero(), box_shape({0.5, 0.3, 0.1}))["angular_velocity"] = {0.01 * rate, rate, 0.01 * rate};
    return scene.text();
}
// Energy and momentum of a free spin both stay.
std::string keeps_spin(const Scene& scene, const EngineRun& run) {
    const BodyDef& b = scene.bodies.front();
    const Mat3 I = body_inertia(b);
    const Vec3 L0 = I * b.angular_velocity;
    const Real E0 = b.angular_velocity.dot(L0);
    Real worst = 0;
    for (const std::vector<BodyState>& states : run.history.states) {
        const Vec3 w = states.front().rotation.conjugate() * states.front().angular_velocity, L = states.front().rotation * Vec3(I * w);
        worst = std::max({worst, (L - L0).norm() / L0.norm(), std::abs(w.dot(I * w) / E0 - 1)});
    }
    return worst <= 0.01 ? std::string() : fmt::format("energy or momentum is off by {:.3g} %", 100 * worst);
}

}  // namespace

std::vector<Limit> speed_limits() {
    return {
        {"speed", "speed of a ball of 0.1 m at a wall of 0.04 m", "m/s", "it does not pass", ladder(1, 1000, 10), shot, stopped},
        {"spin", "spin of a free box about its middle axis", "rad/s", "energy and angular momentum stay within 1 % over 1 s",
         ladder(1, 1000, 10), spinner, keeps_spin},
    };
}

}  // namespace cairn::cli
