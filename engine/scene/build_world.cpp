#include "engine/scene/scene.hpp"

#include "engine/base/error.hpp"

namespace cairn {

namespace {

BodyId id_of(const std::vector<BodyId>& ids, const std::optional<std::size_t>& body) {
    return body ? ids.at(*body) : BodyId{};
}

}  // namespace

SceneWorld build_world(const Scene& scene, WorldSettings settings) {
    settings.gravity = scene.gravity;
    SceneWorld built{World(settings), {}};
    built.ids.reserve(scene.bodies.size());
    for (const BodyDef& body : scene.bodies) built.ids.push_back(built.world.add_body(body));
    for (const SceneJoint& joint : scene.joints) {
        JointDef def = joint.def;
        def.body_a = id_of(built.ids, joint.body_a);
        def.body_b = id_of(built.ids, joint.body_b);
        built.world.add_joint(def);
    }
    return built;
}

}  // namespace cairn
