// Stacks: how many boxes stand.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"

#include <fmt/format.h>

namespace cairn::cli {

namespace {

// Unit boxes on top of one another, every other one moved sideways by `offset` [m].
std::string stack(int count, Real offset, bool quick) {
    SceneWriter scene(fmt::format("stack_{}", count), "Unit boxes on top of one another", quick ? 5 : 10, 0.25);
    scene.ground(0.5);
    for (int k = 0; k < count; ++k) {
        scene.dynamic(fmt::format("box{}", k), 1, {k % 2 == 0 ? -offset / 2 : offset / 2, 0, k + 0.5}, box_shape({0.5, 0.5, 0.5}));
    }
    return scene.text();
}

std::string aligned(double count, bool quick) {
    return stack(static_cast<int>(count), 0, quick);
}
std::string misaligned(double count, bool quick) {
    return stack(static_cast<int>(count), 0.1, quick);
}
std::string ten(double, bool quick) {
    return stack(10, 0, quick);
}
std::string stands(const Scene& scene, const EngineRun& run) {
    return moved_more_than(scene, run, 0.1);
}

}  // namespace

std::vector<Limit> stack_limits() {
    const std::vector<double> counts = ladder(2, 64, 12, true);
    return {
        {"stack", "tallest stack of unit boxes", "boxes", "no box moves by more than 0.1 m or turns by 30°", counts, aligned, stands},
        {"stack-misaligned", "tallest stack, every other box 0.1 m aside", "boxes", "no box moves by more than 0.1 m or turns by 30°",
         counts, misaligned, stands},
        {"step",
         "longest step for a stack of ten",
         "s",
         "no box moves by more than 0.1 m or turns by 30°",
         {1.0 / 1000, 1.0 / 480, 1.0 / 240, 1.0 / 120, 1.0 / 90, 1.0 / 60, 1.0 / 45, 1.0 / 30, 1.0 / 20, 1.0 / 15},
         ten,
         stands,
         [](double rung) { return rung; }},
    };
}

}  // namespace cairn::cli
