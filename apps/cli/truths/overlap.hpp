// Penetration depth from poses alone, apart from the engine's own narrow phase: the least overlap of two convex shapes over all directions,
//     depth = min over unit n of h_A(n) + h_B(−n),   h the support function,
// which is the shortest translation that parts them (Cameron and Culley 1986). Closed forms where there are any; else the directions of
// faces and edge pairs, exact for polytopes (Gottschalk's separating axes), refined by a search for shapes that are round. Meshes are left
// out.
#pragma once

#include "apps/cli/truths.hpp"

namespace cairn::cli {

// Depth [m] of two placed shapes, > 0 where they overlap, else 0. Neither may be a mesh; at most one a plane.
Real overlap_depth(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB);

// For each body the distance down to the nearest thing that bears it from below [m]: 0 where it touches one, at most kSupportReach. From
// below is what lies along a direction with a part upwards. The distances are those along the best of the directions above, which are never
// larger than the true ones; over a mesh, of bounding boxes.
constexpr Real kSupportReach = 0.1;
std::vector<Real> support_gaps(const Scene& scene, const std::vector<BodyState>& states);

struct PenetrationError {
    Real deepest = 0;       // [m], over all pairs that may collide and all samples after t = 0
    Real percentile99 = 0;  // [m], over dynamic bodies and samples, of each body's deepest pair (0 if it has none)
};
PenetrationError penetration_error(const Scene& scene, const History& history);

}  // namespace cairn::cli
