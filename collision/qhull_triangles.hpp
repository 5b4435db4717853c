// The only door to Qhull (Barber, Dobkin & Huhdanpaa 1996). Internal to the collision room.
#pragma once

#include "engine/base/math.hpp"

#include <array>
#include <vector>

namespace cairn {

// The surface of the convex hull as triangles of indices into `points`, counter-clockwise seen from outside. The points should be of size
// about one, centred near the origin. Empty if they have no volume to Qhull's round-off; throws Error if Qhull fails for any other reason.
std::vector<std::array<int, 3>> qhull_triangles(const std::vector<Vec3>& points);

}  // namespace cairn
