#include "apps/cli/study_scenes.hpp"

#include "apps/cli/shipped_scenes.hpp"
#include "engine/base/error.hpp"

namespace cairn::cli {

namespace {

BodyDef ground(Real mu) {
    BodyDef b;
    b.name = "ground";
    b.type = BodyType::kStatic;
    b.shapes = {Shape::plane(Vec3::UnitZ(), 0)};
    b.friction = mu;
    return b;
}

BodyDef unit_box(const std::string& name, const Vec3& position, Real mass, Real mu) {
    BodyDef b;
    b.name = name;
    b.position = position;
    b.mass = mass;
    b.shapes = {Shape::box(Vec3::Constant(0.5))};
    b.friction = mu;
    return b;
}

}  // namespace

Scene sheet_scene(const std::string& name) {
    return load_scene(find_scene(name));
}

Scene box_stack(int count, Real shift, Real mu) {
    Scene scene;
    scene.name = "boxes";
    scene.bodies.push_back(ground(mu));
    for (int k = 0; k < count; ++k) scene.bodies.push_back(unit_box("box" + std::to_string(k), {k * shift, 0, k + 0.5}, 1, mu));
    return scene;
}

Scene heavy_on_light(Real ratio) {
    Scene scene = box_stack(2);
    scene.bodies[2].mass = ratio;
    return scene;
}

Scene launched(const Scene& scene, Real angle) {
    Scene turned = scene;
    const Quat q = exp_rotation(angle * Vec3::UnitZ());
    for (BodyDef& b : turned.bodies) {
        if (b.type != BodyType::kDynamic) continue;
        b.linear_velocity = q * b.linear_velocity;
        b.rotation = q * b.rotation;
    }
    return turned;
}

std::size_t body_index(const Scene& scene, const std::string& name) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (scene.bodies[i].name == name) return i;
    }
    throw Error(scene.name + ": no body is named " + name);
}

}  // namespace cairn::cli
