// Mass, centre of mass and inertia of shapes of uniform density.
#pragma once

#include "engine/base/math.hpp"

#include <vector>

namespace cairn {

class ConvexHull;
struct Shape;

// Volume [m³], centroid [m] and inertia about the centroid at unit density [m⁵]; both in the frame the shape's X_BS leads to.
struct VolumeProperties {
    Real volume = 0;
    Vec3 centroid = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
};

// Closed forms for sphere, box, capsule, cylinder; signed tetrahedra for convex hulls (Tonon 2004). Zero for planes and meshes.
VolumeProperties volume_properties(const Shape& shape);

// Of a hull in its own frame.
VolumeProperties volume_properties(const ConvexHull& hull);

// Sum over shapes (overlaps counted twice), inertia about the common centroid (Steiner's theorem). Zero volume gives all zero.
VolumeProperties volume_properties(const std::vector<Shape>& shapes);

// Principal axes of a symmetric tensor: inertia = R diag(moments) Rᵀ, R a proper rotation.
struct PrincipalInertia {
    Vec3 moments = Vec3::Zero();
    Quat R_BP = Quat::Identity();
};
PrincipalInertia principal_inertia(const Mat3& inertia_B);

}  // namespace cairn
