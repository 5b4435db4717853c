// Writes scene files: bodies and joints go in, text comes out.
#pragma once

#include "engine/base/math.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace cairn::cli {

using OrderedJson = nlohmann::ordered_json;

// Shapes as the file has them. Lengths in m.
OrderedJson box_shape(const Vec3& half_extents);
OrderedJson sphere_shape(Real radius);
OrderedJson capsule_shape(Real radius, Real half_height);
OrderedJson cylinder_shape(Real radius, Real half_height);
OrderedJson convex_shape(const std::vector<Vec3>& points);

// A scene in the making. Numbers are rounded to 1e-9 (nanometres, and what else has a unit), which keeps files short and diffs readable.
class SceneWriter {
public:
    SceneWriter(const std::string& name, const std::string& description, Real duration, Real sample_interval);

    void gravity(const Vec3& g);  // [m/s²]; else 9.81 along −z
    // The half-space z <= 0.
    void ground(Real friction);
    // Ground, and four walls around the square |x|, |y| <= half_width.
    void container(Real half_width, Real height, Real friction);
    // Returns the body's object, so that more keys can be set.
    OrderedJson& dynamic(const std::string& name, Real mass, const Vec3& position, const OrderedJson& shape,
                         const Quat& rotation = Quat::Identity());
    OrderedJson& fixed(const std::string& name, const Vec3& position, const OrderedJson& shape);
    // Moves as its `motion` or its velocities say; set them on what this returns.
    OrderedJson& kinematic(const std::string& name, const Vec3& position, const OrderedJson& shape);
    // body_a: empty for the world.
    OrderedJson& joint(const std::string& type, const std::string& body_a, const std::string& body_b, const Vec3& anchor);

    // The whole file, one body or joint to a line.
    std::string text() const;

private:
    OrderedJson& body(const std::string& name, const char* type, const Vec3& position, const Quat& rotation);

    OrderedJson head_;
    std::vector<OrderedJson> bodies_;
    std::vector<OrderedJson> joints_;
};

// Rounded as in the file.
OrderedJson rounded(const Vec3& v);

}  // namespace cairn::cli
