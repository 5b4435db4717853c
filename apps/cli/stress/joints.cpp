// Joints: long chains, closed loops.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

namespace {

std::string chain(double links, bool quick) {
    const int count = static_cast<int>(links);
    SceneWriter scene(fmt::format("chain_{}", count), "Links on ball joints that meet nothing, let go from level", quick ? 2 : 5, 0.05);
    const Real half = 0.1;
    std::string before;
    for (int k = 0; k < count; ++k) {
        const std::string name = fmt::format("link{}", k);
        OrderedJson& link = scene.dynamic(name, 1, {(2 * k + 1) * half, 0, 50}, box_shape({half, 0.03, 0.03}));
        // Without shapes, which would meet when the chain folds: the limit is of the joints.
        link["shapes"] = OrderedJson::array();
        link["inertia"] = {0.0006, 0.003633333, 0.003633333};  // that of the rod
        scene.joint("ball", before, name, {2 * k * half, 0, 50});
        before = name;
    }
    return scene.text();
}

// A ring of rods joined end to end by ball joints, hung at one of them: a loop, which no tree of coordinates can hold.
std::string ring(double links, bool quick) {
    const int count = static_cast<int>(links);
    SceneWriter scene(fmt::format("ring_{}", count), "A closed ring of rods, hung at one joint", quick ? 2 : 5, 0.05);
    const Real side = 0.4, radius = side / (2 * std::sin(kPi / count));
    const auto corner = [&](int k) { return Vec3(radius * std::sin(2 * kPi * k / count), 0, 20 + radius * std::cos(2 * kPi * k / count)); };
    for (int k = 0; k < count; ++k) {
        const Vec3 way = corner(k + 1) - corner(k);
        const Quat q = Quat::FromTwoVectors(Vec3::UnitX(), way);
        scene.dynamic(fmt::format("rod{}", k), 1, (corner(k) + corner(k + 1)) / 2, box_shape({way.norm() / 2, 0.03, 0.03}), q);
    }
    scene.joint("ball", "", "rod0", corner(0));
    for (int k = 1; k <= count; ++k) scene.joint("ball", fmt::format("rod{}", k - 1), fmt::format("rod{}", k % count), corner(k));
    return scene.text();
}

std::string holds(const Scene& scene, const EngineRun& run) {
    return stretched_more_than(scene, run, 0.01);
}
std::string hangs_together(const Scene& scene, const EngineRun& run) {
    const Real apart = joint_separation(scene, run.history).value;
    return apart <= 0.004 ? std::string() : fmt::format("joints apart by {:.3g} m", apart);
}

}  // namespace

std::vector<Limit> joint_limits() {
    return {
        {"chain", "longest chain of equal links that meet nothing, let go from level", "links", "it stretches by no more than 1 %",
         ladder(2, 200, 12, true), chain, holds},
        {"ring", "largest closed ring of rods, hung at one joint", "rods", "joints are apart by no more than 1 % of a rod, rms",
         ladder(4, 64, 9, true), ring, hangs_together},
    };
}

}  // namespace cairn::cli
