#include "apps/cli/scene_writer.hpp"

#include <cmath>

namespace cairn::cli {

namespace {

// Whole numbers are written as such: 1, not 1.0.
OrderedJson rounded(Real x) {
    const Real nano = std::round(x * 1e9) / 1e9;
    if (nano == std::round(nano) && std::abs(nano) < 1e9) return static_cast<std::int64_t>(nano);
    return nano;
}

void append_list(std::string& text, const char* key, const std::vector<OrderedJson>& items) {
    text += std::string("\"") + key + "\": [";
    for (std::size_t i = 0; i < items.size(); ++i) text += (i == 0 ? "\n  " : ",\n  ") + items[i].dump();
    text += items.empty() ? "]" : "\n]";
}

}  // namespace

OrderedJson rounded(const Vec3& v) {
    return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

OrderedJson box_shape(const Vec3& half_extents) {
    return {{"type", "box"}, {"half_extents", rounded(half_extents)}};
}
OrderedJson sphere_shape(Real radius) {
    return {{"type", "sphere"}, {"radius", rounded(radius)}};
}
OrderedJson capsule_shape(Real radius, Real half_height) {
    return {{"type", "capsule"}, {"radius", rounded(radius)}, {"half_height", rounded(half_height)}};
}
OrderedJson cylinder_shape(Real radius, Real half_height) {
    return {{"type", "cylinder"}, {"radius", rounded(radius)}, {"half_height", rounded(half_height)}};
}
OrderedJson convex_shape(const std::vector<Vec3>& points) {
    OrderedJson list = OrderedJson::array();
    for (const Vec3& p : points) list.push_back(rounded(p));
    OrderedJson shape{{"type", "convex"}};
    shape["points"] = std::move(list);
    return shape;
}

SceneWriter::SceneWriter(const std::string& name, const std::string& description, Real duration, Real sample_interval) {
    head_["format"] = "scene/1";
    head_["name"] = name;
    head_["description"] = description;
    head_["gravity"] = {0, 0, -9.81};
    head_["duration"] = rounded(duration);
    head_["sample_interval"] = rounded(sample_interval);
}

void SceneWriter::gravity(const Vec3& g) {
    head_["gravity"] = rounded(g);
}

void SceneWriter::ground(Real friction) {
    OrderedJson plane{{"type", "plane"}, {"normal", {0, 0, 1}}, {"offset", 0}};
    fixed("ground", Vec3::Zero(), plane)["friction"] = rounded(friction);
}

void SceneWriter::container(Real half_width, Real height, Real friction) {
    ground(friction);
    const Real t = 0.5;  // half the thickness of a wall
    const Real way = half_width + t, length = half_width + 2 * t;
    const Vec3 x(t, length, height / 2), y(length, t, height / 2);
    fixed("wall_east", {way, 0, height / 2}, box_shape(x))["friction"] = rounded(friction);
    fixed("wall_west", {-way, 0, height / 2}, box_shape(x))["friction"] = rounded(friction);
    fixed("wall_north", {0, way, height / 2}, box_shape(y))["friction"] = rounded(friction);
    fixed("wall_south", {0, -way, height / 2}, box_shape(y))["friction"] = rounded(friction);
}

OrderedJson& SceneWriter::body(const std::string& name, const char* type, const Vec3& position, const Quat& rotation) {
    OrderedJson& b = bodies_.emplace_back();
    b["name"] = name;
    b["type"] = type;
    b["position"] = rounded(position);
    if (rotation.coeffs() != Quat::Identity().coeffs()) {
        b["rotation"] = {rounded(rotation.w()), rounded(rotation.x()), rounded(rotation.y()), rounded(rotation.z())};
    }
    return b;
}

OrderedJson& SceneWriter::dynamic(const std::string& name, Real mass, const Vec3& position, const OrderedJson& shape,
                                  const Quat& rotation) {
    OrderedJson& b = body(name, "dynamic", position, rotation);
    b["mass"] = rounded(mass);
    b["shapes"] = OrderedJson::array({shape});
    return b;
}

OrderedJson& SceneWriter::fixed(const std::string& name, const Vec3& position, const OrderedJson& shape) {
    OrderedJson& b = body(name, "static", position, Quat::Identity());
    b["shapes"] = OrderedJson::array({shape});
    return b;
}

OrderedJson& SceneWriter::kinematic(const std::string& name, const Vec3& position, const OrderedJson& shape) {
    OrderedJson& b = body(name, "kinematic", position, Quat::Identity());
    b["shapes"] = OrderedJson::array({shape});
    return b;
}

OrderedJson& SceneWriter::joint(const std::string& type, const std::string& body_a, const std::string& body_b, const Vec3& anchor) {
    OrderedJson& j = joints_.emplace_back();
    j["type"] = type;
    j["body_a"] = body_a.empty() ? OrderedJson(nullptr) : OrderedJson(body_a);
    j["body_b"] = body_b;
    j["anchor"] = rounded(anchor);
    return j;
}

std::string SceneWriter::text() const {
    std::string text = "{\n";
    for (const auto& [key, value] : head_.items()) text += OrderedJson(key).dump() + ": " + value.dump() + ",\n";
    append_list(text, "bodies", bodies_);
    text += ",\n";
    append_list(text, "joints", joints_);
    return text + "\n}\n";
}

}  // namespace cairn::cli
