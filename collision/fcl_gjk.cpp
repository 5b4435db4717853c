// GJK from FCL's parts: with its projections on simplices, whose outcome support planes prove; where they do not, as it extends libccd, so
// that the first direction can be given and an overlap told from a failure. And libccd's portal refinement.
#include "collision/fcl_query.hpp"
#include "collision/hull.hpp"

#include <ccd/ccd.h>
#include <fcl/math/detail/project.h>
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
            if (c.hull != nullptr) return c.centre + c.scale * (c.points[c.hull->support(d)] - c.centre);
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

Vec3 posed_farthest_point(const Core& c, const Vec3& d) {
    return c.R * farthest_point(c, c.R.transpose() * d) + c.p;
}

// Points of the difference A − B, and A's of each.
struct Simplex {
    Vec3 difference[4];
    Vec3 on_a[4];
    int count = 0;
};

// Keeps the corners that span the feature nearest to the origin. Their combination is the nearest point; false if FCL knows none.
bool reduce_to_nearest(Simplex& s, Vec3& difference, Vec3& on_a) {
    using Project = ::fcl::detail::Project<double>;
    Project::ProjectResult r;
    const Vec3* w = s.difference;
    switch (s.count) {
        case 1:
            r.encode = 1;
            r.parameterization[0] = 1;
            break;
        case 2:
            r = Project::projectLineOrigin(w[0], w[1]);
            break;
        case 3:
            r = Project::projectTriangleOrigin(w[0], w[1], w[2]);
            break;
        default:
            r = Project::projectTetrahedraOrigin(w[0], w[1], w[2], w[3]);
            break;
    }
    difference.setZero();
    on_a.setZero();
    int kept = 0;
    for (int i = 0; i < s.count; ++i) {
        if ((r.encode & 1u << i) == 0) continue;
        difference += r.parameterization[i] * s.difference[i];
        on_a += r.parameterization[i] * s.on_a[i];
        s.difference[kept] = s.difference[i];
        s.on_a[kept++] = s.on_a[i];
    }
    s.count = kept;
    return kept > 0 && kept < 4;
}

// Down to where no point of the difference lies clearly nearer along the way to the nearest one known, which so is the nearest. False if it
// does not come to that, or the sets are so near or overlap that the direction between them is not sure.
bool descend_to_nearest(const Core& a, const Core& b, const Vec3& toward_a, Real size, Closest& out) {
    constexpr int kMost = 30;
    constexpr Real kLeast = 1e-5;  // of the size
    Simplex simplex;
    Vec3 direction = toward_a.isZero(0) ? Vec3(Vec3::UnitX()) : toward_a;
    Real nearest2 = 0;
    for (int i = 0; i < kMost; ++i) {
        const Vec3 p = posed_farthest_point(a, -direction);
        const Vec3 w = p - posed_farthest_point(b, direction);
        if (simplex.count > 0 && nearest2 - direction.dot(w) <= kTolerance * size * out.distance) {
            out.b = out.a - direction;
            out.n = direction / out.distance;
            return true;
        }
        simplex.difference[simplex.count] = w;
        simplex.on_a[simplex.count++] = p;
        if (!reduce_to_nearest(simplex, direction, out.a)) return false;
        const Real distance2 = direction.squaredNorm();
        if (!(distance2 > kLeast * kLeast * size * size) || (i > 0 && distance2 >= nearest2)) return false;
        nearest2 = distance2;
        out.distance = std::sqrt(distance2);
    }
    return false;
}

}  // namespace

Answer gjk(const Core& a, const Core& b, const Vec3& toward_a, Real size, Closest& out) noexcept {
    try {
        if (descend_to_nearest(a, b, toward_a, size, out)) return Answer::kApart;
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
