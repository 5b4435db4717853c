// Support points, faces and edges of the convex shapes, for the narrow phase. All in the frame that the placements are given in.
#pragma once

#include "collision/clip.hpp"
#include "collision/fcl_query.hpp"
#include "collision/narrow_phase.hpp"

namespace cairn {

// A triangle in the place of a shape: the mesh code's partner for the convex shapes. Corners counter-clockwise seen from outside.
struct PlacedTriangle {
    Vec3 corner[3];
    Vec3 normal;
};

// The larger distance from a shape's middle to its surface [m]: the scale of tolerances. Planes and meshes have none.
Real shape_size(const Shape& shape);
// Radius of a ball that fits in [m].
Real inner_radius(const Shape& shape);
// The middle of a convex shape: its centroid.
Vec3 centre_of(const PlacedShape& s);

// A point of the shape farthest along the unit vector d.
Vec3 support_point(const PlacedShape& s, const Vec3& d);
// The same as a number: max d·x over the shape.
Real support(const PlacedShape& s, const Vec3& d);

// The round shapes as an axis and a radius: a piece of the axis whose points, moved by `radius` against the unit vector n, give the shape's
// points farthest along −n. Exact also for the rim of a tilted cylinder, and whatever the spin about the axis. A capsule's or a cylinder's.
struct AxisSegment {
    Vec3 end[2];
    Real radius = 0;
};
AxisSegment axis_segment(const PlacedShape& s, const Vec3& n);

// Of a cylinder: cos and sin of the angle between its axis and n.
struct Lean {
    Real cos = 0;
    Real sin = 1;
};
Lean lean_of(const PlacedShape& s, const Vec3& n);
constexpr Real kStanding = 0.05;  // sin of the lean below which a cylinder meets a face with its cap

// The flat face whose outward normal is nearest to d. False if the shape has none there (capsule; cylinder lying).
bool face_towards(const PlacedShape& s, const Vec3& d, Face& face);
// Likewise among the faces that hold the point farthest along d: the face that comes down on something. (The face nearest in direction may
// lie beside that point: a small chamfer far away.)
bool lowest_face(const PlacedShape& s, const Vec3& d, Face& face);
// Its number; −1 for shapes that have none of fixed outline.
int lowest_face_index(const PlacedShape& s, const Vec3& d);
// The outward normal of face_towards alone.
bool face_normal_towards(const PlacedShape& s, const Vec3& d, Vec3& normal);

// The edge (or axis segment) that reaches farthest along −n.
AxisSegment edge_against(const PlacedShape& s, const Vec3& n);
// The same of a box that is posed by X.
AxisSegment box_edge_against(const Transform& X, const Vec3& half_extents, const Vec3& n);

// The shape as FCL's general algorithms see it, drawn in from its surface by `shrink` in [0, 1) of its inner radius (offset for boxes and
// cylinders, scaled about the centroid for hulls; a capsule is its axis). Returns by how much the surface lies outside the core at least.
Real make_core(const PlacedShape& s, Real shrink, fcl_query::Core& core);

}  // namespace cairn
