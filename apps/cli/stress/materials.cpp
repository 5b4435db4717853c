// Friction and restitution.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"
#include "apps/cli/truths/soundness.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

namespace {

// A long flat block on a slope whose tangent is 0.9 μ: friction can hold it, and it cannot topple.
std::string slope(double friction, bool quick) {
    SceneWriter scene("slope", "A flat block on a slope of nine tenths of its friction", quick ? 2 : 5, 0.1);
    const Real angle = std::atan(0.9 * friction);
    const Vec3 n(std::sin(angle), 0, std::cos(angle));
    OrderedJson plane{{"type", "plane"}, {"normal", {n.x(), n.y(), n.z()}}, {"offset", 0}};
    scene.fixed("ground", Vec3::Zero(), plane)["friction"] = friction;
    const Quat q(Eigen::AngleAxis<Real>(angle, Vec3::UnitY()));
    scene.dynamic("block", 1, 0.05 * n, box_shape({1, 1, 0.05}), q)["friction"] = friction;
    return scene.text();
}
std::string sticks(const Scene& scene, const EngineRun& run) {
    return moved_more_than(scene, run, 0.01);
}

// A ball that loses nothing, dropped from a height h; it bounces every 2 √(2 h / g).
constexpr Real kDrop = 0.05;
std::string bounces(double count, bool) {
    const Real period = 2 * std::sqrt(2 * kDrop / 9.81);
    SceneWriter scene("bounces", "A ball of restitution one", std::max(0.5, count * period), std::max(1.0 / 60, count * period / 400));
    scene.ground(0);
    OrderedJson& ball = scene.dynamic("ball", 1, {0, 0, 0.5 + kDrop}, sphere_shape(0.5));
    ball["restitution"] = 1;
    ball["friction"] = 0;
    return scene.text();
}
// Energy above the ball's lowest, relative to that of its start.
std::string keeps_energy(const Scene& scene, const EngineRun& run) {
    const BodyDef& ball = scene.bodies.back();
    const Real g = scene.gravity.norm();
    Real worst = 0;
    for (const std::vector<BodyState>& states : run.history.states) {
        const BodyState& s = states.back();
        const Real height = s.position.z() - ball.position.z() + kDrop + s.linear_velocity.squaredNorm() / (2 * g);
        worst = std::max(worst, std::abs(height / kDrop - 1));
    }
    return worst <= 0.1 ? std::string() : fmt::format("its energy is off by {:.3g} %", 100 * worst);
}

}  // namespace

std::vector<Limit> material_limits() {
    return {
        {"friction", "friction that holds a block on a slope of nine tenths of it", "", "it moves by no more than 0.01 m",
         ladder(0.1, 10, 9), slope, sticks},
        {"bounces", "bounces at restitution 1", "bounces", "the energy stays within 10 %", ladder(1, 1e4, 9, true), bounces, keeps_energy},
    };
}

}  // namespace cairn::cli
