// Sizes: very small, very large, very flat, overlapping.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

namespace {

// Three boxes of this size, at the step of 1/60 s and the gravity that everyone has: small things are hard since a step is long for them.
std::string boxes(double size, bool quick) {
    SceneWriter scene("stack_size", "Three boxes of one size on top of one another", quick ? 2 : 5, 0.1);
    scene.ground(0.5);
    for (int k = 0; k < 3; ++k) {
        scene.dynamic(fmt::format("box{}", k), std::max(1e-6, 1000 * size * size * size), {0, 0, (k + 0.5) * size},
                      box_shape({size / 2, size / 2, size / 2}));
    }
    return scene.text();
}
std::string stands(const Scene& scene, const EngineRun& run) {
    return moved_more_than(scene, run, 0.1 * 2 * scene.bodies.back().shapes.front().half_extents.z());
}

std::string plate(double ratio, bool quick) {
    SceneWriter scene("plate", "A thin plate lies on two blocks", quick ? 2 : 5, 0.1);
    const Real half = 1, thick = half / ratio;
    scene.fixed("left", {-0.8, 0, -0.1}, box_shape({0.1, 1, 0.1}));
    scene.fixed("right", {0.8, 0, -0.1}, box_shape({0.1, 1, 0.1}));
    scene.dynamic("plate", 1, {0, 0, thick}, box_shape({half, half, thick}));
    return scene.text();
}
std::string lies(const Scene& scene, const EngineRun& run) {
    return moved_more_than(scene, run, 0.02);
}

// Two boxes side by side that overlap by this share of their width.
std::string overlapping(double share, bool quick) {
    SceneWriter scene("overlap", "Two boxes overlap at the start", quick ? 2 : 3, 1.0 / 60);
    scene.ground(0.5);
    scene.dynamic("left", 1, {-0.5 * (1 - share), 0, 0.5}, box_shape({0.5, 0.5, 0.5}));
    scene.dynamic("right", 1, {0.5 * (1 - share), 0, 0.5}, box_shape({0.5, 0.5, 0.5}));
    return scene.text();
}
std::string part_gently(const Scene& scene, const EngineRun& run) {
    const Real speed = unexplained_speed(scene, run.history).value;
    return speed <= 1 ? std::string() : fmt::format("thrown apart at {:.3g} m/s", speed);
}

}  // namespace

std::vector<Limit> size_limits() {
    std::vector<double> small = ladder(1, 1e-3, 10), large = ladder(1, 1e3, 10);
    return {
        {"small", "smallest size of three boxes on top of one another", "m", "none moves by more than a tenth of its size or turns by 30°",
         small, boxes, stands},
        {"large", "largest size of three boxes on top of one another", "m", "none moves by more than a tenth of its size or turns by 30°",
         large, boxes, stands},
        {"aspect", "width over thickness of a plate on two blocks", "", "it moves by no more than 0.02 m", ladder(2, 1000, 10), plate,
         lies},
        {"overlap",
         "share of their width that two boxes overlap by at the start",
         "",
         "no speed over 1 m/s that a fall does not explain",
         {0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9},
         overlapping,
         part_gently},
    };
}

}  // namespace cairn::cli
