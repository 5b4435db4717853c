#include "apps/cli/truth_parts.hpp"

#include "collision/extent.hpp"
#include "collision/mass_properties.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

std::vector<std::size_t> dynamic_bodies(const Scene& scene) {
    std::vector<std::size_t> list;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (scene.bodies[i].type == BodyType::kDynamic) list.push_back(i);
    }
    if (list.empty()) throw Error(scene.name + ": bodies, must be at least one dynamic one");
    return list;
}

Vec3 ground_normal(const Scene& scene) {
    for (const BodyDef& body : scene.bodies) {
        for (const Shape& shape : body.shapes) {
            if (shape.type == ShapeType::kPlane) return body.rotation * shape.normal;
        }
    }
    for (const BodyDef& body : scene.bodies) {
        if (body.type == BodyType::kStatic) return -scene.gravity.normalized();
    }
    throw Error(scene.name + ": bodies, must be a static one");
}

Real ground_friction(const Scene& scene, std::size_t body) {
    for (const BodyDef& ground : scene.bodies) {
        if (ground.type == BodyType::kStatic && !ground.shapes.empty()) return std::sqrt(ground.friction * scene.bodies[body].friction);
    }
    throw Error(scene.name + ": bodies, must be a static one");
}

Mat3 body_inertia(const BodyDef& body) {
    if (body.inertia) return body.inertia->asDiagonal();
    const VolumeProperties volume = volume_properties(body.shapes);
    return body.mass / volume.volume * volume.inertia;
}

Real rolling_factor(const BodyDef& body, const Vec3& axis_W) {
    const Vec3 axis_B = body.rotation.conjugate() * axis_W;
    const Real radius = body.shapes.at(0).radius;
    return axis_B.dot(body_inertia(body) * axis_B) / (body.mass * radius * radius);
}

Real angle_between(const Quat& a, const Quat& b) {
    const Quat turn = a.normalized().conjugate() * b.normalized();
    return 2 * std::atan2(turn.vec().norm(), std::abs(turn.w()));
}

JointedGroups jointed_groups(const Scene& scene) {
    std::vector<std::size_t> parent(scene.bodies.size());
    for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = i;
    const auto root = [&parent](std::size_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    const auto is_dynamic = [&scene](const std::optional<std::size_t>& i) { return i && scene.bodies[*i].type == BodyType::kDynamic; };
    for (const SceneJoint& j : scene.joints) {
        if (is_dynamic(j.body_a) && is_dynamic(j.body_b)) parent[root(*j.body_a)] = root(*j.body_b);
    }
    std::vector<bool> held(parent.size(), false);  // by root
    for (const SceneJoint& j : scene.joints) {
        if (is_dynamic(j.body_a) == is_dynamic(j.body_b)) continue;
        held[root(is_dynamic(j.body_a) ? *j.body_a : *j.body_b)] = true;
    }
    JointedGroups groups;
    groups.tied.assign(parent.size(), false);
    std::vector<std::size_t> place(parent.size(), SIZE_MAX);
    for (std::size_t i = 0; i < parent.size(); ++i) {
        if (!is_dynamic(i)) continue;
        const std::size_t r = root(i);
        groups.tied[i] = held[r];
        if (held[r]) continue;
        if (place[r] == SIZE_MAX) {
            place[r] = groups.free.size();
            groups.free.emplace_back();
        }
        groups.free[place[r]].push_back(i);
    }
    return groups;
}

Real holding_radius(const BodyDef& body) {
    Real radius = 0;
    for (const Shape& s : body.shapes) radius = std::max(radius, bounding_radius(s));
    return radius;
}

bool is_named(const std::string& name, const std::string& pattern) {
    if (pattern.back() != '*') return name == pattern;
    return name.compare(0, pattern.size() - 1, pattern, 0, pattern.size() - 1) == 0;
}

Real median(std::vector<Real> x) {
    std::sort(x.begin(), x.end());
    const std::size_t half = x.size() / 2;
    return x.size() % 2 == 1 ? x[half] : (x[half - 1] + x[half]) / 2;
}

}  // namespace cairn::cli
