// The narrow phase's inside: one query, and the functions that answer it for kinds of pairs.
//
// Within them A comes first in the order sphere, capsule, cylinder, box, hull, plane, mesh, and the frame is the world's moved to A's
// position (against cancellation far from the origin); collide_shapes undoes both.
#pragma once

#include "collision/features.hpp"
#include "collision/narrow_phase.hpp"
#include "collision/reduce.hpp"

namespace cairn::narrow {

struct Query {
    PlacedShape a, b;
    Real margin = 0;            // [m]
    Real size = 0;              // [m] of the smaller shape
    Vec3 axis = Vec3::Zero();   // in: the cached axis, from B to A; zero: none. Out: what to cache
    bool was_touching = false;  // `axis` is the normal of a contact, not a separating axis
    bool axis_in_b = false;     // it was kept in B's frame
    bool may_cache = true;      // separating axes of this kind of pair are worth caching
    std::vector<Manifold>& out;
    NarrowStats& stats;
};

// Two spheres, in closed form and in the caller's frame.
NarrowResult collide_spheres(const PlacedShape& a, const PlacedShape& b, Real margin, std::vector<Manifold>& out);

// The answers. Each appends to query.out and sets query.axis.
NarrowResult collide_sphere(Query& q);  // sphere with anything but a sphere or a mesh
NarrowResult collide_capsules(Query& q);
NarrowResult collide_capsule_box(Query& q);
NarrowResult collide_boxes(Query& q);
NarrowResult collide_convex(Query& q);  // any two bounded convex shapes
NarrowResult collide_cores(Query& q);   // the same, whatever touched last
NarrowResult collide_with_plane(Query& q);
NarrowResult collide_with_mesh(Query& q);

inline NarrowResult separated(Query& q, const Vec3& axis) {
    q.axis = axis;
    return NarrowResult::kSeparated;
}

inline NarrowResult failed(Query& q) {
    ++q.stats.failures;
    return NarrowResult::kFailed;
}

// Separation of the two shapes along n (unit, from B to A): positive proves them apart.
inline Real separation_along(const Query& q, const Vec3& n) {
    return -support(q.a, -n) - support(q.b, n);
}

// One point: core points and radii; the separation follows. kSeparated beyond the margin.
NarrowResult add_point(Query& q, const Vec3& n, NormalOwner owner, const Vec3& core_a, Real radius_a, const Vec3& core_b, Real radius_b,
                       std::uint32_t feature);

// The manifold of two bounded convex shapes whose contact direction n (from B to A) FCL has found: a face contact with exactly the face's
// normal where one is as good, else one or two points on edges. False, and nothing done, if no features are found along n that tell the
// shapes' separation along it: then n is not quite the direction of contact.
bool try_manifold(Query& q, const Vec3& n, NarrowResult& result);

// The pair touched along q.axis, which was a face's normal: whether that face touches still, and then the manifold, without FCL. Proven by
// the other shape's deepest point, which lies over the face: for shapes that are apart the normal then is the direction of least distance,
// since convex sets have no other; for a shallow overlap it is the nearest local one, which the last contact was. False, and nothing done,
// if it is not proven. (Crossed edges are not answered so: once they overlap, a face may be nearer without the edges telling.)
bool try_last_contact(Query& q, NarrowResult& result);

// Points of `incident` over the face, nearer than `margin`. Features are unique among them.
int face_candidates(const PlacedShape& incident, const Face& face, Real margin, Real size, Candidate out[kMaxCandidates]);

// The same for the shape's lowest face, where that is what comes down: for boxes, hulls and cylinders that stand.
bool comes_down_flat(const PlacedShape& incident, const Vec3& normal, Face& lowest);
int flat_candidates(const Face& lowest, const Face& face, Real margin, Real size, Candidate out[kMaxCandidates]);

// A manifold of the candidates (count > 0), the face on A's side or on B's.
void add_face_manifold(Query& q, const Vec3& face_normal, bool face_is_b, Candidate* candidates, int count);

// Contact of two segments with radii (edges or axes of round shapes): one point, or two where they run side by side. False as above.
bool try_segments(Query& q, const Vec3& n, const AxisSegment& a, const AxisSegment& b, NarrowResult& result);

}  // namespace cairn::narrow
