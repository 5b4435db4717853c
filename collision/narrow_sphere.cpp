// A sphere against each kind of shape: one point, its core the sphere's centre.
#include "collision/narrow_pair.hpp"

#include "collision/hull.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

using fcl_query::Answer;
using fcl_query::PointHit;

constexpr std::uint32_t kOnlyPoint = 1;

// Appends the point of a sphere at distance hit.distance from a surface; `radius_b` of that distance belongs to a round core of B.
NarrowResult add_sphere_point(Query& q, const PointHit& hit, NormalOwner owner, Real radius_b) {
    const Vec3& centre = q.a.X_WS.p;
    const Vec3 core_b = centre - (hit.distance + radius_b) * hit.n;
    return add_point(q, hit.n, owner, centre, q.a.shape->radius, core_b, radius_b, kOnlyPoint);
}

NarrowResult with_capsule(Query& q, Real reach) {
    PointHit hit;
    const Real radius_b = q.b.shape->radius;
    const Answer answer = fcl_query::point_segment(q.a.X_WS.p, q.b.X_WS, q.b.shape->half_height, reach + radius_b, hit);
    if (answer == Answer::kFailed) return failed(q);
    if (answer == Answer::kApart) return NarrowResult::kSeparated;
    if (hit.n.isZero(0)) hit.n = q.b.X_WS.R.col(0);  // on the axis: across it
    hit.distance -= radius_b;
    return add_sphere_point(q, hit, NormalOwner::kNone, radius_b);
}

NarrowResult with_box(Query& q, Real reach) {
    // Beyond a face by more than the reach: no corner is nearer, and the face's normal may answer the next query too.
    const Vec3 beyond = q.b.X_WS.to_local(q.a.X_WS.p).cwiseAbs() - q.b.shape->half_extents;
    int side = 0;
    if (beyond.maxCoeff(&side) >= reach) {
        const Vec3 normal = q.b.X_WS.R.col(side);
        return separated(q, normal.dot(q.a.X_WS.p - q.b.X_WS.p) > 0 ? normal : Vec3(-normal));
    }
    PointHit hit;
    ++q.stats.fcl_calls;
    const Answer answer = fcl_query::point_box(q.a.X_WS.p, q.b.X_WS, q.b.shape->half_extents, reach, hit);
    if (answer == Answer::kFailed) return failed(q);
    if (answer == Answer::kApart) return NarrowResult::kSeparated;
    // Over a face exactly one component of n is not zero.
    const Vec3 local = q.b.X_WS.R.transpose() * hit.n;
    int axis = 0;
    const bool face = local.cwiseAbs().maxCoeff(&axis) > 1 - 1e-12;
    if (face) hit.n = local[axis] > 0 ? Vec3(q.b.X_WS.R.col(axis)) : Vec3(-q.b.X_WS.R.col(axis));
    return add_sphere_point(q, hit, face ? NormalOwner::kB : NormalOwner::kNone, 0);
}

NarrowResult with_cylinder(Query& q, Real reach) {
    PointHit hit;
    const Real radius_b = q.b.shape->radius;
    const Answer answer = fcl_query::point_cylinder(q.a.X_WS.p, q.b.X_WS, radius_b, q.b.shape->half_height, reach, hit);
    if (answer == Answer::kFailed) return failed(q);
    if (answer == Answer::kApart) return NarrowResult::kSeparated;
    const Vec3 z = q.b.X_WS.R.col(2);
    const Real along = z.dot(hit.n);
    if (std::abs(along) > 1 - 1e-12) {
        hit.n = along > 0 ? z : Vec3(-z);
        return add_sphere_point(q, hit, NormalOwner::kB, 0);
    }
    // On the barrel the core lies on the axis, at the rim on the rim.
    return add_sphere_point(q, hit, NormalOwner::kNone, std::abs(along) < 1e-9 ? radius_b : 0);
}

// The face of a hull that is nearest to a point inside it, or that the point is most outside of.
Real hull_face_over(const ConvexHull& hull, const Vec3& point_S, int& face) {
    Real highest = 0;
    for (int i = 0; i < static_cast<int>(hull.faces().size()); ++i) {
        const Real height = hull.faces()[i].normal.dot(point_S) - hull.faces()[i].offset;
        if (i == 0 || height > highest) highest = height, face = i;
    }
    return highest;
}

NarrowResult with_hull(Query& q, Real reach) {
    const ConvexHull& hull = *q.b.shape->hull;
    const Vec3& centre = q.a.X_WS.p;
    int face = 0;
    const Real height = hull_face_over(hull, q.b.X_WS.to_local(centre), face);
    const Vec3 normal = q.b.X_WS.R * hull.faces()[face].normal;
    if (height >= reach) return separated(q, normal);

    PointHit hit{normal, height};
    NormalOwner owner = NormalOwner::kB;
    if (height > 1e-6 * q.size) {  // outside: FCL; inside the nearest face is exact
        ++q.stats.fcl_calls;
        fcl_query::Core point, solid;
        make_core(q.a, 0, point);
        make_core(q.b, 0, solid);
        fcl_query::Closest closest;
        const Answer answer = fcl_query::gjk(point, solid, q.axis.isZero(0) ? normal : q.axis, q.size, closest);
        if (answer == Answer::kFailed) return failed(q);
        if (answer == Answer::kApart && closest.distance > height * (1 + 1e-9)) {
            hit = {closest.n, closest.distance};
            owner = NormalOwner::kNone;
        }
    }
    if (hit.distance >= reach) return separated(q, hit.n);
    return add_sphere_point(q, hit, owner, 0);
}

}  // namespace

NarrowResult collide_spheres(const PlacedShape& a, const PlacedShape& b, Real margin, std::vector<Manifold>& out) {
    const Vec3 d = a.X_WS.p - b.X_WS.p;
    const Real distance = d.norm(), separation = distance - a.shape->radius - b.shape->radius;
    if (separation >= margin) return NarrowResult::kSeparated;
    Manifold& m = out.emplace_back();
    m.n = distance > 1e-12 * a.shape->radius ? Vec3(d / distance) : Vec3::UnitZ();  // one centre on the other: any direction
    m.owner = NormalOwner::kCores;
    m.count = 1;
    m.points[0] = {a.X_WS.p, b.X_WS.p, a.shape->radius, b.shape->radius, separation, kOnlyPoint};
    return NarrowResult::kTouching;
}

NarrowResult collide_sphere(Query& q) {
    const Real reach = q.a.shape->radius + q.margin;
    if (q.b.shape->type == ShapeType::kHull) return with_hull(q, reach);
    if (q.b.shape->type == ShapeType::kBox) return with_box(q, reach);
    ++q.stats.fcl_calls;
    q.may_cache = false;
    switch (q.b.shape->type) {
        case ShapeType::kCapsule:
            return with_capsule(q, reach);
        default:
            return with_cylinder(q, reach);
    }
}

}  // namespace cairn::narrow
