// GJK as FCL extends libccd, composed from FCL's own parts so that the first direction can be given and an overlap told from a failure; and
// libccd's portal refinement.
#include "collision/fcl_query.hpp"

#include <ccd/ccd.h>
#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>

namespace cairn::fcl_query {
namespace {

namespace ext = ::fcl::detail::libccd_extension;

constexpr unsigned long kMaxIterations = 128;
constexpr Real kTolerance = 1e-8;

// libccd's loops end when support points stop improving, or after kMaxIterations; should one not, then past this number of calls every
// support point is the origin, which improves nothing.
constexpr int kMaxCalls = 2000;

struct Body {
    const Core* core;
    Real inverse_size;
    Vec3 first_direction = Vec3::Zero();  // of the first body: where libccd looks first
    Vec3 centre = Vec3::Zero();           // for MPR
    int calls = 0;
};

Vec3 from_ccd(const ccd_vec3_t& v) {
    return Vec3(v.v[0], v.v[1], v.v[2]);
}

ccd_vec3_t to_ccd(const Vec3& v) {
    ccd_vec3_t out;
    for (int k = 0; k < 3; ++k) out.v[k] = v[k];
    return out;
}

Vec3 farthest_point(const Core& c, const Vec3& d) {
    switch (c.kind) {
        case Core::Kind::kSegment:
            return Vec3(0, 0, d.z() > 0 ? c.half.z() : -c.half.z());
        case Core::Kind::kBox:
            return Vec3(d.x() > 0 ? c.half.x() : -c.half.x(), d.y() > 0 ? c.half.y() : -c.half.y(), d.z() > 0 ? c.half.z() : -c.half.z());
        case Core::Kind::kCylinder: {
            const Real across = std::sqrt(d.x() * d.x() + d.y() * d.y());
            const Real k = across > 1e-12 * std::abs(d.z()) && across > 0 ? c.half.x() / across : 0;
            return Vec3(k * d.x(), k * d.y(), d.z() > 0 ? c.half.z() : -c.half.z());
        }
        case Core::Kind::kPoints: {
            int best = 0;
            Real farthest = d.dot(c.points[0]);
            for (int i = 1; i < c.count; ++i) {
                const Real x = d.dot(c.points[i]);
                if (x > farthest) farthest = x, best = i;
            }
            return c.centre + c.scale * (c.points[best] - c.centre);
        }
        default:
            return Vec3::Zero();
    }
}

void support_callback(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* point) {
    Body& body = *static_cast<Body*>(const_cast<void*>(object));
    if (++body.calls > kMaxCalls) {
        *point = to_ccd(Vec3::Zero());
        return;
    }
    const Core& c = *body.core;
    const Vec3 p = c.R * farthest_point(c, c.R.transpose() * from_ccd(*direction)) + c.p;
    *point = to_ccd(body.inverse_size * p);
}

void centre_callback(const void* object, ccd_vec3_t* point) {
    *point = to_ccd(static_cast<const Body*>(object)->centre);
}

void first_direction_callback(const void* object, const void*, ccd_vec3_t* direction) {
    *direction = to_ccd(static_cast<const Body*>(object)->first_direction);
}

// A's far point against n and B's along it make the first corner of the difference A − B.
Body first_body(const Core& a, const Vec3& toward_a, Real size) {
    return {&a, 1 / size, toward_a.isZero(0) ? Vec3(Vec3::UnitX()) : Vec3(-toward_a)};
}

Body second_body(const Core& b, Real size) {
    return {&b, 1 / size};
}

ccd_t settings() {
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.first_dir = first_direction_callback;
    ccd.support1 = ccd.support2 = support_callback;
    ccd.center1 = ccd.center2 = centre_callback;
    ccd.max_iterations = kMaxIterations;
    ccd.mpr_tolerance = ccd.dist_tolerance = kTolerance;
    return ccd;
}

}  // namespace

Answer gjk(const Core& a, const Core& b, const Vec3& toward_a, Real size, Closest& out) noexcept {
    try {
        Body body_a = first_body(a, toward_a, size), body_b = second_body(b, size);
        const ccd_t ccd = settings();
        ccd_simplex_t simplex;
        if (ext::__ccdGJK(&body_a, &body_b, &ccd, &simplex) == 0) return Answer::kContact;
        ccd_vec3_t on_a, on_b;
        const Real distance = ext::_ccdDist(&body_a, &body_b, &ccd, &simplex, &on_a, &on_b);
        out.a = size * from_ccd(on_a);
        out.b = size * from_ccd(on_b);
        const Vec3 d = out.a - out.b;
        out.distance = d.norm();
        if (distance < 0 || !std::isfinite(out.distance)) return Answer::kFailed;
        if (!(out.distance > 0)) return Answer::kContact;
        out.n = d / out.distance;
        return Answer::kApart;
    } catch (...) {
        return Answer::kFailed;
    }
}

Answer mpr(const Core& a, const Core& b, const Vec3& guess, Real size, Vec3& n) noexcept {
    try {
        Body body_a = first_body(a, guess, size), body_b = second_body(b, size);
        body_a.centre = (a.R * a.centre + a.p) / size;
        body_b.centre = (b.R * b.centre + b.p) / size;
        const Vec3 between = body_a.centre - body_b.centre;
        const Real along = between.dot(guess);
        if (along > kTolerance) body_b.centre += 0.9 * (between - along * guess);
        const ccd_t ccd = settings();
        ccd_real_t depth = 0;
        ccd_vec3_t direction, position;
        if (ccdMPRPenetration(&body_a, &body_b, &ccd, &depth, &direction, &position) != 0) return Answer::kApart;
        n = -from_ccd(direction);
        const Real length = n.norm();
        if (!std::isfinite(depth) || !(length > 0.5)) return Answer::kFailed;
        n /= length;
        return Answer::kContact;
    } catch (...) {
        return Answer::kFailed;
    }
}

}  // namespace cairn::fcl_query
