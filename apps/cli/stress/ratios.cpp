// Mass ratios: heavy things on light ones, which is where iterations converge slowest.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"

#include <fmt/format.h>

namespace cairn::cli {

namespace {

std::string column(const char* name, const std::vector<Real>& masses, bool quick) {
    SceneWriter scene(name, "Unit boxes of unlike masses on top of one another", quick ? 3 : 10, 0.1);
    scene.ground(0.5);
    for (std::size_t k = 0; k < masses.size(); ++k) {
        scene.dynamic(fmt::format("box{}", k), masses[k], {0, 0, static_cast<Real>(k) + 0.5}, box_shape({0.5, 0.5, 0.5}));
    }
    return scene.text();
}

std::string heavy_on_light(double ratio, bool quick) {
    return column("heavy_on_light", {1, ratio}, quick);
}
std::string light_between(double ratio, bool quick) {
    return column("heavy_on_light_between", {ratio, 1, ratio}, quick);
}
std::string loaded_chain(double ratio, bool quick) {
    SceneWriter scene("chain_load", "Ten links of 1 kg hang in line with a load at the end", quick ? 2 : 5, 0.05);
    const Real half = 0.25;
    std::string before;
    for (int k = 0; k < 10; ++k) {
        const std::string name = fmt::format("link{}", k);
        scene.dynamic(name, 1, {(2 * k + 1) * half, 0, 10}, box_shape({half, 0.05, 0.05}));
        scene.joint("ball", before, name, {2 * k * half, 0, 10});
        before = name;
    }
    scene.dynamic("load", ratio, {20 * half + 0.2, 0, 10}, sphere_shape(0.2));
    scene.joint("ball", before, "load", {20 * half, 0, 10});
    return scene.text();
}
std::string stands(const Scene& scene, const EngineRun& run) {
    return moved_more_than(scene, run, 0.05);
}
std::string holds(const Scene& scene, const EngineRun& run) {
    return stretched_more_than(scene, run, 0.01);
}

}  // namespace

std::vector<Limit> ratio_limits() {
    const std::vector<double> ratios = ladder(1, 1e6, 13);
    return {
        {"heavy-on-light", "mass ratio, heavy box on a light one", "", "no box moves by more than 0.05 m or turns by 30°", ratios,
         heavy_on_light, stands},
        {"light-between", "mass ratio, light box between two heavy ones", "", "no box moves by more than 0.05 m or turns by 30°", ratios,
         light_between, stands},
        {"chain-load", "load at the end of ten links, let go from level, over a link's mass", "", "the chain stretches by no more than 1 %",
         ratios, loaded_chain, holds},
    };
}

}  // namespace cairn::cli
