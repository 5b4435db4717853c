// Driven walls: gravity that turns over, a box that is squeezed.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"
#include "apps/cli/truths/soundness.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

namespace {

// A closed box that turns upside down and back, so many times a second: seen from it, gravity flips. Cubes inside.
std::string tumbler(double flips, bool quick) {
    SceneWriter scene("tumbler", "Cubes in a closed box that turns upside down and back", quick ? 2 : 5, 0.05);
    const Real inner = 1, wall = 0.1;
    OrderedJson& box = scene.kinematic("box", {0, 0, 5}, box_shape({inner, inner, wall}));
    OrderedJson walls = OrderedJson::array();
    for (int axis = 0; axis < 3; ++axis) {
        for (const Real side : {-1.0, 1.0}) {
            Vec3 half = Vec3::Constant(inner + 2 * wall);
            half[axis] = wall;
            OrderedJson one = box_shape(half);
            one["position"] = rounded(Vec3(side * (inner + wall) * Vec3::Unit(axis)));
            walls.push_back(one);
        }
    }
    box["shapes"] = walls;
    box["motion"] = {{"type", "rotate_sine"}, {"axis", {1, 0, 0}}, {"amplitude", kPi / 2}, {"period", 2 / flips}, {"phase", 0}};
    for (int k = 0; k < 8; ++k) {
        scene.dynamic(fmt::format("cube{}", k), 1, {0.5 * (k & 1) - 0.25, 0.25 * (k & 2) - 0.25, 5 - 0.78 + 0.11 * (k & 4)},
                      box_shape({0.2, 0.2, 0.2}));
    }
    return scene.text();
}
std::string stays_inside(const Scene& scene, const EngineRun& run) {
    for (std::size_t k = 0; k < run.history.t.size(); ++k) {
        const BodyState& box = run.history.states[k].front();
        for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
            const Vec3 inside = box.rotation.conjugate() * (run.history.states[k][i].position - box.position);
            if (inside.cwiseAbs().maxCoeff() > 1.0)
                return fmt::format("{} has left the box at {:.3g} s", scene.bodies[i].name, run.history.t[k]);
        }
    }
    return {};
}

// Two walls close in on a box of 1 m until they are this share of it nearer than it is wide: there is no answer, but there are bad ones.
std::string squeeze(double share, bool) {
    SceneWriter scene("squeeze", "Two walls close in on a box", 2, 0.05);
    scene.ground(0.5);
    const Real speed = (0.2 + share) / 4;  // of each wall, which starts 0.1 m beside the box
    for (const Real side : {-1.0, 1.0}) {
        OrderedJson& wall = scene.kinematic(side < 0 ? "left" : "right", {side * (0.5 + 0.1 + 0.25), 0, 1}, box_shape({0.25, 2, 1}));
        wall["linear_velocity"] = {-side * speed, 0, 0};
    }
    scene.dynamic("box", 1, {0, 0, 0.5}, box_shape({0.5, 0.5, 0.5}));
    return scene.text();
}
std::string stays_put(const Scene& scene, const EngineRun& run) {
    for (std::size_t k = 0; k < run.history.t.size(); ++k) {
        const BodyState& s = run.history.states[k].back();
        if (s.linear_velocity.norm() > 1)
            return fmt::format("it moves at {:.3g} m/s at {:.3g} s", s.linear_velocity.norm(), run.history.t[k]);
        if ((s.position - scene.bodies.back().position).norm() > 0.25) return fmt::format("it is thrown out by {:.3g} s", run.history.t[k]);
    }
    return {};
}

}  // namespace

std::vector<Limit> driven_limits() {
    return {
        {"flips", "times a second that a box with cubes in it is turned upside down", "1/s", "no cube leaves it", ladder(0.25, 16, 7),
         tumbler, stays_inside},
        {"squeeze",
         "share of its width that walls jam a box by",
         "",
         "it stays where it is, slower than 1 m/s",
         {0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6},
         squeeze,
         stays_put},
    };
}

}  // namespace cairn::cli
