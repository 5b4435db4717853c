// Support points, edges and closest points of cores (the shapes as GJK sees them, drawn in), which tell a contact's direction without GJK
// where the features that are nearest can be guessed, and prove it. All in the frame of the placements.
#pragma once

#include "collision/features.hpp"

namespace cairn {

// Signed distance of a core's farthest point along d (unit) from the frame's origin. Not for cylinders.
Real core_support(const PlacedShape& s, const fcl_query::Core& core, const Vec3& d);

// A core's point that is farthest along d. Of boxes, segments and hulls.
Vec3 core_support_point(const PlacedShape& s, const fcl_query::Core& core, const Vec3& d);

// The core's edge that reaches farthest along −n. False for what has no straight ones.
bool core_edge(const PlacedShape& s, const fcl_query::Core& core, const Vec3& n, AxisSegment& edge);

// FCL's closest points of two segments. False if they are nearer than `least`.
bool closest_of_segments(const AxisSegment& a, const AxisSegment& b, Real least, fcl_query::Closest& closest);

}  // namespace cairn
