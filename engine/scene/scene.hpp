// Scene files, format scene/1 (docs/formats.md): read, check, build a world from.
#pragma once

#include "engine/body.hpp"
#include "engine/joint.hpp"
#include "engine/world.hpp"

#include <optional>
#include <string>
#include <vector>

namespace cairn {

struct SceneJoint {
    JointDef def;                       // body_a, body_b are filled when the world is built
    std::optional<std::size_t> body_a;  // index into Scene::bodies; nothing: the world
    std::optional<std::size_t> body_b;
};

struct Scene {
    std::string name;
    std::string description;
    Vec3 gravity{0, 0, -9.81};
    Real duration = 1;         // [s]
    Real sample_interval = 0;  // [s]
    std::vector<BodyDef> bodies;
    std::vector<SceneJoint> joints;
};

// Reads a file. Throws Error with one line per mistake, each with its place:
//     FILE: bodies[12].shapes[0].radius: -1, must be > 0
Scene load_scene(const std::string& path);
// The same from text; `source` names it in messages.
Scene parse_scene(const std::string& text, const std::string& source);

// A world with the scene's bodies and joints. ids[i] belongs to scene.bodies[i]. Settings but for gravity are the caller's.
struct SceneWorld {
    World world;
    std::vector<BodyId> ids;
};
SceneWorld build_world(const Scene& scene, WorldSettings settings);

}  // namespace cairn
