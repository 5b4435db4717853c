// Structures that stand by friction: arches, houses of cards.
#include "apps/cli/scene_writer.hpp"
#include "apps/cli/stress/limit.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

namespace {

// A half ring of wedges between an inner radius of 3 m and an outer one of 4 m (it stands from about 1.11 on: Milankovitch 1907), on blocks
// that cannot move. Each wedge is the hull of its eight corners.
std::string arch(double stones, bool quick) {
    const int count = static_cast<int>(stones);
    SceneWriter scene(fmt::format("arch_{}", count), "A half ring of wedges", quick ? 3 : 8, 0.1);
    const Real inner = 3, outer = 4, depth = 0.5, density = 2000;
    const Real angle = kPi / count;
    scene.fixed("left", {-(inner + outer) / 2, 0, -0.5}, box_shape({1, 1, 0.5}))["friction"] = 0.9;
    scene.fixed("right", {(inner + outer) / 2, 0, -0.5}, box_shape({1, 1, 0.5}))["friction"] = 0.9;
    const Real half = angle / 2;
    // The wedge's own frame: z outwards through its middle, x along the arch. Centroid of a ring segment cut straight by chords:
    const auto width = [&](Real r) { return 2 * r * std::sin(half); };
    const auto height = [&](Real r) { return r * std::cos(half); };
    const Real a = width(inner), b = width(outer), tall = height(outer) - height(inner);
    const Real middle = height(inner) + tall / 3 * (a + 2 * b) / (a + b);
    const Real mass = density * (a + b) / 2 * tall * 2 * depth;
    for (int k = 0; k < count; ++k) {
        const Real turn = -kPi / 2 + (k + 0.5) * angle;
        const Quat q(Eigen::AngleAxis<Real>(turn, Vec3::UnitY()));
        std::vector<Vec3> corners;
        for (const Real r : {inner, outer}) {
            for (const Real x : {-1.0, 1.0}) {
                for (const Real y : {-1.0, 1.0}) corners.push_back({x * width(r) / 2, y * depth, height(r) - middle});
            }
        }
        scene.dynamic(fmt::format("stone{}", k), mass, q * Vec3(0, 0, middle), convex_shape(corners), q)["friction"] = 0.9;
    }
    return scene.text();
}

// Pairs of leaning cards with a card across each two, so many storeys.
std::string cards(double storeys, bool quick) {
    const int count = static_cast<int>(storeys);
    SceneWriter scene(fmt::format("cards_{}", count), "A house of cards", quick ? 2 : 5, 0.1);
    const Real half = 0.5, thick = 0.02, lean = 25 * kPi / 180, friction = 0.8;
    scene.ground(friction);
    // Half the way between the feet of a pair, and the height of a storey.
    const Real foot = half * std::sin(lean) + thick * std::cos(lean), tall = 2 * (half * std::cos(lean) + thick * std::sin(lean));
    const Real pitch = 4 * foot, gap = 1e-4;
    for (int row = 0; row < count; ++row) {
        const Real floor = row * (tall + 2 * thick + 2 * gap);
        const int pairs = count - row;
        for (int k = 0; k < pairs; ++k) {
            const Real x = pitch * (k - (pairs - 1) / 2.0);
            for (const Real side : {-1.0, 1.0}) {
                const Quat q(Eigen::AngleAxis<Real>(-side * lean, Vec3::UnitY()));
                scene.dynamic(fmt::format("card{}_{}_{}", row, k, side < 0 ? "l" : "r"), 1, {x + side * (foot + gap), 0, floor + tall / 2},
                              box_shape({thick, 0.4, half}), q)["friction"] = friction;
            }
            if (k == 0) continue;
            scene.dynamic(fmt::format("roof{}_{}", row, k), 1, {x - pitch / 2, 0, floor + tall + thick + gap},
                          box_shape({pitch / 2 - gap, 0.4, thick}))["friction"] = friction;
        }
    }
    return scene.text();
}

std::string stands(const Scene& scene, const EngineRun& run) {
    return moved_more_than(scene, run, 0.1);
}

}  // namespace

std::vector<Limit> structure_limits() {
    return {
        {"arch",
         "stones of a half ring, ratio of radii 3 : 4",
         "stones",
         "no stone moves by more than 0.1 m or turns by 30°",
         {3, 5, 7, 9, 13, 17, 25, 33, 49},
         arch,
         stands},
        {"cards",
         "storeys of a house of cards",
         "storeys",
         "no card moves by more than 0.1 m or turns by 30°",
         {1, 2, 3, 4, 5, 6, 8},
         cards,
         stands},
    };
}

}  // namespace cairn::cli
