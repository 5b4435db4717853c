// What the truths read from a scene.
#pragma once

#include "apps/cli/truths.hpp"

namespace cairn::cli {

// Indices of the dynamic bodies.
std::vector<std::size_t> dynamic_bodies(const Scene& scene);

// Unit normal of the first static plane, world frame; of level ground where there is no plane but a static body.
Vec3 ground_normal(const Scene& scene);

// Coefficient of friction of body i on the first static body that has a shape: √(μ_a μ_b). Throws Error if there is none.
Real ground_friction(const Scene& scene, std::size_t body);

// Moments of inertia about the centre of mass in the body frame [kg m²]: the given ones, or those of the shapes at uniform density.
Mat3 body_inertia(const BodyDef& body);

// Inertia about the shape's axis of rotation over m r², r the radius of the body's first shape: 2/5 of a ball, 1/2 of a cylinder lying
// down. `axis_W` [unit] is the axis that it turns about.
Real rolling_factor(const BodyDef& body, const Vec3& axis_W);

// Angle of the rotation that takes a to b, in [0, π].
Real angle_between(const Quat& a, const Quat& b);

// Dynamic bodies that joints tie together: the groups that nothing holds (one body alone is a group), and which bodies are tied to the
// world or to a body that is not dynamic.
struct JointedGroups {
    std::vector<std::vector<std::size_t>> free;
    std::vector<bool> tied;  // by body of the scene
};
JointedGroups jointed_groups(const Scene& scene);

// Radius of the sphere about the body's origin that holds its shapes [m]; infinite with a plane or a mesh.
Real holding_radius(const BodyDef& body);

// Whether a scene is meant by a name, or by the beginning of names before a *.
bool is_named(const std::string& name, const std::string& pattern);

// The median; of two in the middle their mean. `x` must not be empty.
Real median(std::vector<Real> x);

}  // namespace cairn::cli
