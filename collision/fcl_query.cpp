// The closed-form entry points of FCL. Its templates are instantiated here: libfcl's own copies have their asserts live.
#include "collision/fcl_query.hpp"

#include <fcl/math/detail/project.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/box_box.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/capsule_capsule.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/halfspace.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_box.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_capsule.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_cylinder.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_sphere.h>

#include <vector>

namespace fcl {
template struct ContactPoint<double>;
template Halfspace<double> transform(const Halfspace<double>&, const Transform3<double>&);
}  // namespace fcl

namespace fcl::detail {

using Contacts = std::vector<ContactPoint<double>>;

template bool sphereSphereIntersect(const Sphere<double>&, const Transform3<double>&, const Sphere<double>&, const Transform3<double>&,
                                    Contacts*);
template bool sphereCapsuleIntersect(const Sphere<double>&, const Transform3<double>&, const Capsule<double>&, const Transform3<double>&,
                                     Contacts*);
template bool sphereBoxIntersect(const Sphere<double>&, const Transform3<double>&, const Box<double>&, const Transform3<double>&,
                                 Contacts*);
template bool sphereCylinderIntersect(const Sphere<double>&, const Transform3<double>&, const Cylinder<double>&, const Transform3<double>&,
                                      Contacts*);
template bool sphereHalfspaceIntersect(const Sphere<double>&, const Transform3<double>&, const Halfspace<double>&,
                                       const Transform3<double>&, Contacts*);
template class Project<double>;
template void cullPoints2(int, double[], int, int, int[]);
template int intersectRectQuad2(double[2], double[8], double[16]);
template void lineClosestApproach(const Vector3<double>&, const Vector3<double>&, const Vector3<double>&, const Vector3<double>&, double*,
                                  double*);
template double clamp(double, double, double);
template void lineSegmentPointClosestToPoint(const Vector3<double>&, const Vector3<double>&, const Vector3<double>&, Vector3<double>&);
template double closestPtSegmentSegment(const Vector3<double>&, const Vector3<double>&, const Vector3<double>&, const Vector3<double>&,
                                        double*, double*, Vector3<double>*, Vector3<double>*);

}  // namespace fcl::detail

namespace cairn::fcl_query {
namespace {

namespace detail = ::fcl::detail;
using Pose3 = ::fcl::Transform3<double>;

// FCL's shapes have virtual functions and boxes of their own: one set per thread, re-dimensioned for each query.
struct Scratch {
    ::fcl::Sphere<double> sphere{1};
    ::fcl::Sphere<double> point{0};
    ::fcl::Capsule<double> capsule{0, 1};
    ::fcl::Box<double> box{1, 1, 1};
    ::fcl::Cylinder<double> cylinder{1, 1};
    ::fcl::Halfspace<double> half_space;
    detail::Contacts contacts;

    Scratch() { contacts.reserve(16); }
};

Scratch& scratch() {
    thread_local Scratch s;
    s.contacts.clear();
    return s;
}

Pose3 to_fcl(const Transform& X) {
    Pose3 out;
    out.linear() = X.R;
    out.translation() = X.p;
    out.makeAffine();
    return out;
}

Pose3 at(const Vec3& p) {
    Pose3 out = Pose3::Identity();
    out.translation() = p;
    return out;
}

// From FCL's (normal from the point into the shape, depth of a sphere of radius `reach`) to ours.
Answer point_answer(bool hit_found, const detail::Contacts& contacts, Real reach, PointHit& hit) {
    if (!hit_found || contacts.empty()) return Answer::kApart;
    hit.n = -contacts[0].normal;
    hit.distance = reach - contacts[0].penetration_depth;
    const Real length2 = hit.n.squaredNorm();
    if (!std::isfinite(hit.distance) || !std::isfinite(length2)) return Answer::kFailed;
    if (length2 < 0.25) hit.n.setZero();
    return Answer::kContact;
}

template <class Query>
Answer guarded(Query query) noexcept {
    try {
        return query();
    } catch (...) {
        return Answer::kFailed;
    }
}

}  // namespace

Answer point_point(const Vec3& point, const Vec3& other, Real reach, PointHit& hit) noexcept {
    return guarded([&] {
        Scratch& s = scratch();
        s.sphere.radius = reach;
        const bool found = detail::sphereSphereIntersect(s.sphere, at(point), s.point, at(other), &s.contacts);
        return point_answer(found, s.contacts, reach, hit);
    });
}

Answer point_segment(const Vec3& point, const Transform& X, Real half_length, Real reach, PointHit& hit) noexcept {
    return guarded([&] {
        Scratch& s = scratch();
        s.sphere.radius = reach;
        s.capsule.lz = 2 * half_length;
        const bool found = detail::sphereCapsuleIntersect(s.sphere, at(point), s.capsule, to_fcl(X), &s.contacts);
        return point_answer(found, s.contacts, reach, hit);
    });
}

Answer point_box(const Vec3& point, const Transform& X, const Vec3& half_extents, Real reach, PointHit& hit) noexcept {
    return guarded([&] {
        Scratch& s = scratch();
        s.sphere.radius = reach;
        s.box.side = 2 * half_extents;
        const bool found = detail::sphereBoxIntersect(s.sphere, at(point), s.box, to_fcl(X), &s.contacts);
        return point_answer(found, s.contacts, reach, hit);
    });
}

Answer point_cylinder(const Vec3& point, const Transform& X, Real radius, Real half_height, Real reach, PointHit& hit) noexcept {
    return guarded([&] {
        Scratch& s = scratch();
        s.sphere.radius = reach;
        s.cylinder.radius = radius;
        s.cylinder.lz = 2 * half_height;
        const bool found = detail::sphereCylinderIntersect(s.sphere, at(point), s.cylinder, to_fcl(X), &s.contacts);
        return point_answer(found, s.contacts, reach, hit);
    });
}

Answer point_half_space(const Vec3& point, const Vec3& normal, Real offset, Real reach, PointHit& hit) noexcept {
    return guarded([&] {
        Scratch& s = scratch();
        s.sphere.radius = reach;
        s.half_space.n = normal;
        s.half_space.d = offset;
        const bool found = detail::sphereHalfspaceIntersect(s.sphere, at(point), s.half_space, Pose3(Pose3::Identity()), &s.contacts);
        return point_answer(found, s.contacts, reach, hit);
    });
}

int nearest_on_triangle(const Vec3& point, const Vec3& p0, const Vec3& p1, const Vec3& p2, Vec3& nearest) noexcept {
    const detail::Project<double>::ProjectResult result = detail::Project<double>::projectTriangle(p0, p1, p2, point);
    const double* w = result.parameterization;
    nearest = w[0] * p0 + w[1] * p1 + w[2] * p2;
    return std::isfinite(result.sqr_distance) && is_finite(nearest) ? static_cast<int>(result.encode) : 0;
}

Answer box_box(const Transform& X_A, const Vec3& half_a, const Transform& X_B, const Vec3& half_b, BoxHit& hit) noexcept {
    return guarded([&] {
        Scratch& s = scratch();
        constexpr int kAllPoints = 8;
        constexpr int kFirstEdgeCode = 7;
        Vec3 n;
        Real depth = 0;
        int code = 0;
        const Vec3 side_a = 2 * half_a, side_b = 2 * half_b;
        detail::boxBox2(side_a, X_A.R, X_A.p, side_b, X_B.R, X_B.p, n, &depth, &code, kAllPoints, s.contacts);
        if (code == 0) return Answer::kApart;
        hit.n = -n;
        hit.distance = -depth;
        hit.is_edge = code >= kFirstEdgeCode;
        return std::isfinite(depth) && std::abs(n.squaredNorm() - 1) < 1e-6 ? Answer::kContact : Answer::kFailed;
    });
}

void segment_segment(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1, Vec3& a, Vec3& b) noexcept {
    Real s = 0, t = 0;
    detail::closestPtSegmentSegment(p0, p1, q0, q1, &s, &t, &a, &b);
}

}  // namespace cairn::fcl_query
