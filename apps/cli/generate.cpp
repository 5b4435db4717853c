#include "apps/cli/generate.hpp"

#include "apps/cli/random.hpp"
#include "apps/cli/scene_writer.hpp"
#include "collision/mass_properties.hpp"
#include "collision/shape.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

// generate_ragdolls.cpp
void fill_ragdolls(SceneWriter& scene, int count, Random& random);

namespace {

std::string numbered(const char* name, int k) {
    return name + std::to_string(k);
}

void fill_stack(SceneWriter& scene, int count, Random&) {
    const Real h = 0.3;
    scene.ground(0.5);
    for (int k = 0; k < count; ++k) scene.dynamic(numbered("crate", k), 20, {0, 0, (2 * k + 1) * h}, box_shape({h, h, h}));
}

void fill_pyramid(SceneWriter& scene, int count, Random&) {
    const Real h = 0.25, pitch = 2 * h + 0.04;
    scene.ground(0.5);
    for (int row = 0; row < count; ++row) {
        for (int k = 0; k < count - row; ++k) {
            const Real x = pitch * (k - (count - row - 1) / 2.0);
            scene.dynamic("stone" + std::to_string(row) + "_" + std::to_string(k), 10, {x, 0, (2 * row + 1) * h}, box_shape({h, h, h}));
        }
    }
}

// Where the k-th of `count` falling things starts: in layers of side × side cells of this pitch, a little beside their middles.
struct Layers {
    int side;
    Real pitch;
    Layers(int count, Real pitch_) : side(std::clamp(static_cast<int>(std::round(std::cbrt(0.5 * count))), 3, 40)), pitch(pitch_) {}
    Real half_width() const { return side * pitch / 2 + 0.2; }
    Real height(int count) const { return pitch * (count / (side * side) + 3); }
    Vec3 at(int k, Random& random) const {
        const Vec3 cell(k % side - (side - 1) / 2.0, k / side % side - (side - 1) / 2.0, k / (side * side) + 1);
        const Vec3 beside(random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06));
        return pitch * (cell + beside);
    }
};

constexpr Real kDensity = 700;  // kg/m³, about that of wood

void fill_pile(SceneWriter& scene, int count, Random& random) {
    const Layers layers(count, 0.7);
    scene.container(layers.half_width(), layers.height(count), 0.5);
    for (int k = 0; k < count; ++k) {
        const Vec3 p = layers.at(k, random);
        const Quat q = random.rotation();
        const Real s = random.uniform(0.14, 0.2);
        const std::string name = numbered("thing", k);
        switch (k % 4) {
            case 0:
                scene.dynamic(name, kDensity * 8 * s * s * s * 0.8, p, box_shape({s, 0.8 * s, s}), q);
                break;
            case 1:
                scene.dynamic(name, kDensity * 4 / 3 * kPi * s * s * s, p, sphere_shape(s), q);
                break;
            case 2:
                scene.dynamic(name, kDensity * kPi * 0.36 * s * s * (1.6 * s + 0.8 * s), p, capsule_shape(0.6 * s, 0.8 * s), q);
                break;
            default:
                scene.dynamic(name, kDensity * kPi * 0.64 * s * s * 1.6 * s, p, cylinder_shape(0.8 * s, 0.8 * s), q);
                break;
        }
    }
}

void fill_balls(SceneWriter& scene, int count, Random& random) {
    const Layers layers(count, 0.45);
    scene.container(layers.half_width(), layers.height(count), 0.4);
    for (int k = 0; k < count; ++k) scene.dynamic(numbered("ball", k), 5, layers.at(k, random), sphere_shape(0.18));
}

void fill_hulls(SceneWriter& scene, int count, Random& random) {
    const Layers layers(count, 0.8);
    scene.container(layers.half_width(), layers.height(count), 0.5);
    for (int k = 0; k < count; ++k) {
        const Vec3 flat(1, random.uniform(0.6, 1), random.uniform(0.6, 1));
        std::vector<Vec3> points(static_cast<std::size_t>(random.uniform(10, 24)));
        for (Vec3& p : points) p = 0.32 * random.uniform(0.85, 1) * flat.cwiseProduct(random.direction());
        // The origin of a body is its centre of mass.
        const VolumeProperties volume = volume_properties(Shape::convex(points));
        for (Vec3& p : points) p -= volume.centroid;
        scene.dynamic(numbered("stone", k), kDensity * volume.volume, layers.at(k, random), convex_shape(points));
    }
}

void fill_chain(SceneWriter& scene, int count, Random&) {
    const Real half = 0.15, radius = 0.03, load = 0.2;
    std::string before;
    for (int k = 0; k < count; ++k) {
        const std::string name = numbered("link", k);
        // The capsule's axis, z in its own frame, along x.
        OrderedJson rod = capsule_shape(radius, half - radius);
        rod["rotation"] = {std::sqrt(0.5), 0, std::sqrt(0.5), 0};
        scene.dynamic(name, 0.5, {(2 * k + 1) * half, 0, 10}, rod);
        scene.joint("ball", before, name, {2 * k * half, 0, 10});
        before = name;
    }
    scene.dynamic("load", 25, {2 * count * half + load, 0, 10}, sphere_shape(load));
    scene.joint("ball", before, "load", {2 * count * half, 0, 10});
}

void fill_wall(SceneWriter& scene, int count, Random&) {
    const Vec3 h(0.3, 0.15, 0.12);
    scene.ground(0.6);
    for (int row = 0; row < count; ++row) {
        for (int k = 0; k < count; ++k) {
            const Real x = (2 * h.x() + 0.01) * (k - (count - 1) / 2.0 + (row % 2 == 0 ? -0.25 : 0.25));
            scene.dynamic("brick" + std::to_string(row) + "_" + std::to_string(k), 30, {x, 0, (2 * row + 1) * h.z()}, box_shape(h));
        }
    }
    scene.dynamic("ball", 400, {0.1, -6, 1.2}, sphere_shape(0.4))["linear_velocity"] = {0, 14, 0};
}

}  // namespace

const std::vector<Generator>& generators() {
    static const std::vector<Generator> list = {
        {"stack", 40, 10'000, "Boxes on top of one another", 5, 0.1, fill_stack},
        {"pyramid", 40, 400, "A pyramid of boxes, one deep; the count is of its rows", 5, 0.25, fill_pyramid},
        {"wall", 10, 200, "A wall of as many rows as bricks in a row, hit by a heavy ball", 4, 0.1, fill_wall},
        {"pile", 2000, 200'000, "Boxes, balls, capsules and cylinders fall into a walled square", 5, 0.25, fill_pile},
        {"balls", 1000, 200'000, "Equal balls fall into a walled square", 5, 0.25, fill_balls},
        {"hulls", 200, 100'000, "Convex stones fall into a walled square", 5, 0.25, fill_hulls},
        {"chain", 50, 10'000, "Links on ball joints with a load at the end, let go from level", 5, 0.05, fill_chain},
        {"ragdolls", 50, 20'000, "Jointed figures of eleven bodies fall on the ground", 4, 0.1, fill_ragdolls},
    };
    return list;
}

const Generator& generator(const std::string& kind) {
    std::string kinds;
    for (const Generator& g : generators()) {
        if (kind == g.kind) return g;
        kinds.append(kinds.empty() ? "" : ", ").append(g.kind);
    }
    throw_invalid("kind of scene", kind, "one of " + kinds);
}

GeneratedScene generate_scene(const Generator& g, int count, std::uint64_t seed) {
    if (count < 1 || count > g.most)
        throw_invalid(std::string(g.kind) + ": --count", std::to_string(count), "from 1 to " + std::to_string(g.most));
    const std::string name = std::string(g.kind) + "_" + std::to_string(count);
    SceneWriter scene(name, g.description, g.duration, g.sample_interval);
    Random random(seed);
    g.fill(scene, count, random);
    return {name, scene.text()};
}

}  // namespace cairn::cli
