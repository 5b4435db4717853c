// What the narrow phase says of two shapes: up to four points with one normal.
//
// Sign conventions: the unit normal n points from B to A, C = nᵀ(r_A − r_B) is the separation (negative when penetrating).
//
// A point is given by a *core* point on each side and a radius: the surface points are
//     r_A = core_a − radius_a n,    r_B = core_b + radius_b n,    separation = nᵀ(core_a − core_b) − radius_a − radius_b.
// The core points are material (fixed in their bodies); the round offset along n is not. So the separation of a rolling ball, capsule or
// lying cylinder stays exact while the body turns, and that of a vertex over a face stays exact while either body turns. For vertex-face
// points core_a and core_b are a vertex and the foot of its perpendicular on the other's face, whichever side owns the face.
#pragma once

#include "engine/base/math.hpp"

#include <array>
#include <cstdint>

namespace cairn {

constexpr int kMaxManifoldPoints = 4;

struct ManifoldPoint {
    Vec3 core_a = Vec3::Zero();  // [m], world frame at the time of the query
    Vec3 core_b = Vec3::Zero();
    Real radius_a = 0;  // [m]
    Real radius_b = 0;
    Real separation = 0;        // [m]
    std::uint32_t feature = 0;  // stable while the same vertices, edges and faces touch; unique within the manifold
};

// Whose face the normal belongs to: the normal turns with that body. kNone: it depends on both poses (edge-edge, round shapes),
// and holds only as long as the relative pose does. kCores: it is the direction from core_b to core_a of the manifold's one point, whatever
// the poses (two spheres).
enum class NormalOwner : std::uint8_t { kNone, kA, kB, kCores };

struct Manifold {
    Vec3 n = Vec3::UnitZ();  // unit, world, from B to A
    NormalOwner owner = NormalOwner::kNone;
    std::uint32_t sub_key = 0;  // tells the manifolds of one shape pair apart (mesh: a cluster of triangles); 0 for convex pairs
    int count = 0;
    std::array<ManifoldPoint, kMaxManifoldPoints> points;
};

}  // namespace cairn
