// What FCL 0.7 and libccd are asked for: closest points, depths and normals of two convex shapes. Only fcl_*.cpp include their headers;
// here are our types alone.
//
// Conventions: normals are unit and point from the second shape to the first; distances are negative when penetrating [m]. All poses and
// points in one frame of the caller's choice. Nothing here throws or hangs: an exception of FCL or libccd, a result that is not finite and
// an iteration limit all come back as kFailed. No allocation once warm.
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>

namespace cairn {
class ConvexHull;
}

namespace cairn::fcl_query {

enum class Answer : std::uint8_t { kApart, kContact, kFailed };

// A point near a shape: distance from the shape's surface (negative inside) and the direction away from it; zero if FCL knows none
// (a point exactly at a centre or on an axis).
struct PointHit {
    Vec3 n = Vec3::Zero();
    Real distance = 0;
};

// kApart if the point is farther than `reach` (> 0). detail::sphere*Intersect with the reach as the sphere's radius.
Answer point_point(const Vec3& point, const Vec3& other, Real reach, PointHit& hit) noexcept;
Answer point_segment(const Vec3& point, const Transform& X, Real half_length, Real reach, PointHit& hit) noexcept;  // along z of X
Answer point_box(const Vec3& point, const Transform& X, const Vec3& half_extents, Real reach, PointHit& hit) noexcept;
Answer point_cylinder(const Vec3& point, const Transform& X, Real radius, Real half_height, Real reach, PointHit& hit) noexcept;
// Half-space normal·x <= offset.
Answer point_half_space(const Vec3& point, const Vec3& normal, Real offset, Real reach, PointHit& hit) noexcept;
// The point of a triangle nearest to `point`. Returns which corners span the feature it lies on: bit k for corner k (7: inside); 0: failed.
int nearest_on_triangle(const Vec3& point, const Vec3& p0, const Vec3& p1, const Vec3& p2, Vec3& nearest) noexcept;

// The axis of least penetration of two boxes by the separating axis test (detail::boxBox2; edges must beat faces by 5 %).
// kApart: they do not overlap, n and distance are not set. `is_edge`: n is the cross product of two edges, otherwise a face normal.
struct BoxHit {
    Vec3 n = Vec3::Zero();
    Real distance = 0;
    bool is_edge = false;
};
Answer box_box(const Transform& X_A, const Vec3& half_a, const Transform& X_B, const Vec3& half_b, BoxHit& hit) noexcept;

// Closest points a on segment p0 p1 and b on segment q0 q1.
void segment_segment(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1, Vec3& a, Vec3& b) noexcept;

// A convex set for the general algorithms, given by its support function.
struct Core {
    enum class Kind : std::uint8_t { kPoint, kSegment, kBox, kCylinder, kPoints };
    Kind kind = Kind::kPoint;
    Mat3 R = Mat3::Identity();
    Vec3 p = Vec3::Zero();
    Vec3 half = Vec3::Zero();      // box: half extents; segment: (0, 0, half length); cylinder: (radius, radius, half height)
    const Vec3* points = nullptr;  // kPoints: centre + scale (points[i] − centre), then posed by R, p
    int count = 0;
    const ConvexHull* hull = nullptr;  // whose vertices they are, if any: it finds the farthest faster
    Real scale = 1;
    Vec3 centre = Vec3::Zero();  // in the core's frame; a point well inside
};

// Closest points of two disjoint sets; distance >= 0, n = (a − b) / distance where distance > 0.
struct Closest {
    Vec3 a = Vec3::Zero();
    Vec3 b = Vec3::Zero();
    Vec3 n = Vec3::Zero();
    Real distance = 0;
};

// Gilbert, Johnson, Keerthi 1988 as in FCL's GJKDistance. `size` [m]: of the smaller shape; libccd has absolute thresholds, so it is given
// lengths in units of it; the tolerance is 1e-8 of it. `toward_a`: guess of n, the first direction searched (zero: none).
// kContact: the sets overlap, `out` is not set.
Answer gjk(const Core& a, const Core& b, const Vec3& toward_a, Real size, Closest& out) noexcept;

// Minkowski portal refinement (Snethen 2008; FCL's GJKCollide) with B's inner point moved so that the ray through the difference A − B runs
// along `guess`: the normal n of the face through which that ray leaves, roughly. kApart: they do not overlap.
// (FCL's expanding polytope, GJKSignedDistance, would find the least penetration at once, but it walks into null pointers on nearly
// degenerate polytopes, which no caller can catch.)
Answer mpr(const Core& a, const Core& b, const Vec3& guess, Real size, Vec3& n) noexcept;

}  // namespace cairn::fcl_query
