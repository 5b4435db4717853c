// What every adapter works out of a scene.
#pragma once

#include "apps/cli/rivals/rival.hpp"

#include <utility>

namespace cairn::cli {

// Inertia about the centre of mass in the body frame [kg m²]: the given one, or that of the shapes at uniform density. Without either:
// zero.
Mat3 inertia_of(const BodyDef& body);

// Pose of a kinematic body at time t [s]: its prescribed motion, or else its constant velocities (world frame).
Pose driven_pose(const BodyDef& body, Real t);

// The constant velocity that takes a body from one pose to the other in h [s]: linear and angular [rad/s], world frame.
std::pair<Vec3, Vec3> velocity_between(const Pose& from, const Pose& to, Real h);

// The rotation whose columns are the right-handed unit triad (x, y, x × y).
Quat triad(const Vec3& x, const Vec3& y);

// Throws Unsupported for what none of the adapters has: rolling and torsional friction.
void refuse_what_no_adapter_has(const Scene& scene);

}  // namespace cairn::cli
