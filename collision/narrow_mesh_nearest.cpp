// Where a shape's core and a triangle are nearest. Guessed from their features and proven by support planes where possible, which costs a
// fraction of GJK; else FCL's GJK tells.
#include "collision/core_features.hpp"
#include "collision/narrow_mesh.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

using fcl_query::Answer;
using fcl_query::Closest;
using fcl_query::Core;

// Of the size.
constexpr Real kLeast = 1e-4;  // distances below this are left to GJK
constexpr Real kTolerance = 1e-9;
constexpr Real kLevel = 1e-6;
constexpr int kMaxGuesses = 2;
constexpr int kInside = 7;

Real top_of(const Vec3 corner[3], const Vec3& n) {
    return std::max({n.dot(corner[0]), n.dot(corner[1]), n.dot(corner[2])});
}

// The corners that are as high along n as the highest.
int level_corners(const Vec3 corner[3], const Vec3& n, Real top, Real size) {
    int level = 0;
    for (int k = 0; k < 3; ++k)
        if (n.dot(corner[k]) > top - kLevel * size) level |= 1 << k;
    return level;
}

// The side of the triangle that a point lies farthest beyond, seen along the normal; −1 if it lies over the triangle.
int side_towards(const Vec3& p, const Vec3 corner[3], const Vec3& normal) {
    int side = -1;
    Real farthest = 0;
    for (int k = 0; k < 3; ++k) {
        const Vec3 out = (corner[(k + 1) % 3] - corner[k]).cross(normal);
        const Real beyond = out.dot(p - corner[k]);
        if (beyond > 0 && beyond * beyond > farthest * out.squaredNorm()) farthest = beyond * beyond / out.squaredNorm(), side = k;
    }
    return side;
}

// The core's lowest point lies over the triangle.
bool is_point_nearest(const Query& q, const Vec3& p, const Vec3 corner[3], const Vec3& normal, Closest& c) {
    const Real height = normal.dot(p - corner[0]);
    if (!(height > kLeast * q.size)) return false;
    c = {p, p - height * normal, normal, height};
    return true;
}

// The triangle's highest corner along the normal of the shape's own face lies under that face.
bool is_face_nearest(const Query& q, const Face& own, Real drawn_in, const Vec3 corner[3], const Vec3& normal, Closest& c, int& corners) {
    const Vec3 n = -own.normal;
    if (n.dot(normal) < 0.5) return false;
    const Real top = top_of(corner, n);
    const Real distance = drawn_in - own.offset - top;
    if (!(distance > kLeast * q.size)) return false;
    corners = level_corners(corner, n, top, q.size);
    for (int k = 0; k < 3; ++k) {
        if ((corners & 1 << k) == 0 || !is_over(corner[k], own, 0)) continue;
        c = {corner[k] + distance * n, corner[k], n, distance};
        return true;
    }
    return false;
}

// A point of the surface, drawn in.
Vec3 drawn_in_point(const Query& q, const Core& core, const Vec3& p) {
    if (core.kind == Core::Kind::kBox) {
        const Vec3 local = (core.R.transpose() * (p - core.p)).cwiseQuotient(q.a.shape->half_extents).cwiseProduct(core.half);
        return core.R * local + core.p;
    }
    const Vec3 centre = core.R * core.centre + core.p;
    return centre + core.scale * (p - centre);
}

// The nearest points of an edge of the core and one of the triangle, if planes through them prove that nothing is nearer; or any direction
// along which the shape is out of reach.
bool is_pair_nearest(Query& q, const Core& core, const AxisSegment& a, const Vec3 corner[3], int from, Closest& c, int& corners) {
    const int to = (from + 1) % 3;
    ++q.stats.fcl_calls;
    if (!closest_of_segments(a, {{corner[from], corner[to]}, 0}, kLeast * q.size, c)) return false;
    const Real top = top_of(corner, c.n);
    const bool is_far = -support(q.a, -c.n) - top >= q.margin;
    if (!is_far && -core_support(q.a, core, -c.n) - top < c.distance - kTolerance * q.size) return false;
    const Vec3 edge = corner[to] - corner[from];
    const Real x = edge.dot(c.b - corner[from]), length2 = edge.squaredNorm();
    corners = (x < (1 - kTolerance) * length2 ? 1 << from : 0) | (x > kTolerance * length2 ? 1 << to : 0);
    return true;
}

// The edges that cross where the shape's own face, clipped by the triangle, is lowest.
bool are_crossing_edges_nearest(Query& q, const Core& core, const OwnFace& own, const Vec3 corner[3], Closest& c, int& corners) {
    if (own.edge < 0) return false;
    const Polygon& outline = own.face->outline;
    const int next = own.edge + 1 == outline.count ? 0 : own.edge + 1;
    const AxisSegment edge{{drawn_in_point(q, core, outline.corner[own.edge]), drawn_in_point(q, core, outline.corner[next])}, 0};
    return is_pair_nearest(q, core, edge, corner, own.side, c, corners);
}

// Edges of both that reach farthest towards each other along a guessed direction, and then along the one between them.
bool are_edges_nearest(Query& q, const Core& core, const Vec3 corner[3], const Vec3& guess, int side, Closest& c, int& corners) {
    Vec3 n = guess;
    for (int i = 0; i < kMaxGuesses; ++i) {
        AxisSegment a;
        if (!core_edge(q.a, core, n, a)) return false;
        if (is_pair_nearest(q, core, a, corner, side, c, corners)) return true;
        if (!(c.distance > kLeast * q.size)) return false;
        n = c.n;
        const Real height[3] = {n.dot(corner[0]), n.dot(corner[1]), n.dot(corner[2])};
        const int low = height[0] < height[1] ? (height[0] < height[2] ? 0 : 2) : (height[1] < height[2] ? 1 : 2);
        side = (low + 1) % 3;
    }
    return false;
}

}  // namespace

Answer closest_to_triangle(Query& q, Real shrink, const OwnFace& own, const Vec3 corner[3], const Vec3& normal, Closest& c, int& corners) {
    Core core;
    const Real drawn_in = make_core(q.a, shrink, core);
    const bool has_corners = core.kind != Core::Kind::kCylinder;
    c.n = normal;
    corners = kInside;
    int side = 0;
    if (has_corners) {
        const Vec3 lowest = core_support_point(q.a, core, -normal);
        side = side_towards(lowest, corner, normal);
        if (side < 0 && is_point_nearest(q, lowest, corner, normal, c)) return Answer::kApart;
        side = std::max(side, 0);
    }
    if (own.face != nullptr && is_face_nearest(q, *own.face, drawn_in, corner, normal, c, corners)) return Answer::kApart;
    if (!has_corners ||
        (!are_crossing_edges_nearest(q, core, own, corner, c, corners) && !are_edges_nearest(q, core, corner, normal, side, c, corners))) {
        ++q.stats.fcl_calls;
        Core triangle;
        triangle.kind = Core::Kind::kPoints;
        triangle.points = corner;
        triangle.count = 3;
        const Answer answer = fcl_query::gjk(core, triangle, c.n, q.size, c);
        if (answer != Answer::kApart) return answer;
        Vec3 nearest;
        corners = fcl_query::nearest_on_triangle(c.b, corner[0], corner[1], corner[2], nearest);
        if (corners == 0) return Answer::kFailed;
    }
    // Rounding may move the point off its corner or edge: the touching feature is level along n.
    const int level = level_corners(corner, c.n, top_of(corner, c.n), q.size);
    if ((corners & level) != 0) corners &= level;
    return Answer::kApart;
}

}  // namespace cairn::narrow
