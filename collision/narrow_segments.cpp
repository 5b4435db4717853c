// Contacts without a face: edges and axes of round shapes, one point or two side by side; and the capsule pairs that need nothing else.
#include "collision/narrow_pair.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

constexpr Real kParallel = 0.02;  // sine of the angle below which two segments run side by side

struct Closest {
    Vec3 a, b;
    bool inside = false;  // neither is an end point: a − b is perpendicular to both segments
};

bool is_inside(const Vec3& p, const AxisSegment& s) {
    const Vec3 u = s.end[1] - s.end[0];
    const Real x = u.dot(p - s.end[0]), l2 = u.squaredNorm();
    return x > 1e-9 * l2 && x < (1 - 1e-9) * l2;
}

Closest closest_points(const AxisSegment& a, const AxisSegment& b) {
    Closest c;
    fcl_query::segment_segment(a.end[0], a.end[1], b.end[0], b.end[1], c.a, c.b);
    c.inside = is_inside(c.a, a) && is_inside(c.b, b);
    return c;
}

// FCL's direction made exact where the segments alone fix it.
Vec3 refined(const Query& q, const Vec3& n, const AxisSegment& a, const AxisSegment& b, const Closest& c, Real sine) {
    const Vec3 d = c.a - c.b;
    const Real length = d.norm();
    const bool has_flat_end = q.a.shape->type == ShapeType::kCylinder || q.b.shape->type == ShapeType::kCylinder;
    const Real round = a.radius + b.radius;
    if ((c.inside || !has_flat_end) && length > (round > 0 ? 1e-6 * round : 1e-6 * q.size)) {
        const Vec3 m = d / length;
        if (m.dot(n) > 0.9) return m;
    }
    if (c.inside && sine > kParallel) {
        Vec3 m = (a.end[1] - a.end[0]).cross(b.end[1] - b.end[0]).normalized();
        if (m.dot(n) < 0) m = -m;
        if (m.dot(n) > 0.9) return m;
    }
    return n;
}

// Where the segments run side by side: the ends of their overlap on either. False if it is shorter than `least`.
bool overlap(const AxisSegment& a, const AxisSegment& b, Real least, Vec3 on_a[2], Vec3 on_b[2]) {
    const Vec3 u = a.end[1] - a.end[0], v = b.end[1] - b.end[0];
    const Real uu = u.squaredNorm(), vv = v.squaredNorm();
    Real t[2] = {u.dot(b.end[0] - a.end[0]) / uu, u.dot(b.end[1] - a.end[0]) / uu};
    if (t[0] > t[1]) std::swap(t[0], t[1]);
    t[0] = std::max(t[0], 0.0);
    t[1] = std::min(t[1], 1.0);
    if ((t[1] - t[0]) * std::sqrt(uu) < least) return false;
    for (int i = 0; i < 2; ++i) {
        on_a[i] = a.end[0] + t[i] * u;
        on_b[i] = b.end[0] + std::clamp(v.dot(on_a[i] - b.end[0]) / vv, 0.0, 1.0) * v;
    }
    return true;
}

bool add_pair(Query& q, const Vec3& n, const AxisSegment& a, const AxisSegment& b) {
    Vec3 on_a[2], on_b[2];
    if (!overlap(a, b, 1e-3 * q.size, on_a, on_b)) return false;
    Manifold m;
    m.n = n;
    for (int i = 0; i < 2; ++i) {
        const Real separation = n.dot(on_a[i] - on_b[i]) - a.radius - b.radius;
        if (separation < q.margin)
            m.points[m.count++] = {on_a[i], on_b[i], a.radius, b.radius, separation, static_cast<std::uint32_t>(2 + i)};
    }
    if (m.count == 0) return false;
    q.out.push_back(m);
    q.axis = n;
    return true;
}

}  // namespace

bool try_segments(Query& q, const Vec3& n, const AxisSegment& a, const AxisSegment& b, NarrowResult& result) {
    const Vec3 u = a.end[1] - a.end[0], v = b.end[1] - b.end[0];
    const Real uv = std::sqrt(u.squaredNorm() * v.squaredNorm());
    // The rim of a tilted cylinder is a point, and its core lies far inside: what is closest is closest to the point itself.
    const bool rim_a = u.isZero(0) && a.radius > 0, rim_b = v.isZero(0) && b.radius > 0;
    AxisSegment moved_a = a, moved_b = b;
    if (rim_a && q.a.shape->type == ShapeType::kCylinder) moved_a.end[0] = moved_a.end[1] = a.end[0] - (a.radius + b.radius) * n;
    if (rim_b && q.b.shape->type == ShapeType::kCylinder) moved_b.end[0] = moved_b.end[1] = b.end[0] + (a.radius + b.radius) * n;
    const Closest c = closest_points(moved_a, moved_b);
    const Vec3 core_a = rim_a ? a.end[0] : c.a, core_b = rim_b ? b.end[0] : c.b;

    const Real sine = uv > 0 ? u.cross(v).norm() / uv : 1;
    const Vec3 m = rim_a || rim_b ? n : refined(q, n, a, b, c, sine);
    // Were these not the segments that touch, their points would not lie opposite each other, as deep as the shapes are.
    const Real along_m = separation_along(q, m);
    const Real separation = m.dot(core_a - core_b) - a.radius - b.radius;
    const Vec3 d = core_a - core_b;
    const Real aside = (d - d.dot(m) * m).norm();
    if (separation > along_m + 0.02 * std::abs(along_m) + 1e-5 * q.size || aside > 1e-3 * q.size + 0.02 * std::abs(along_m)) return false;
    if (uv > 0 && sine < kParallel && add_pair(q, m, a, b)) {
        result = NarrowResult::kTouching;
        return true;
    }
    result = add_point(q, m, NormalOwner::kNone, core_a, a.radius, core_b, b.radius, 1);
    return true;
}

NarrowResult collide_capsules(Query& q) {
    ++q.stats.fcl_calls;
    const AxisSegment a = axis_segment(q.a, Vec3::UnitZ()), b = axis_segment(q.b, Vec3::UnitZ());
    const Closest c = closest_points(a, b);
    const Real round = a.radius + b.radius;
    const Vec3 d = c.a - c.b;
    const Real length = d.norm();
    if (!std::isfinite(length)) return failed(q);
    if (length - round >= q.margin) return separated(q, d / length);

    // Axes that cross have no direction between them: out of their plane, towards A's centre if it lies anywhere.
    Vec3 n;
    if (length > 1e-9 * round) {
        n = d / length;
    } else {
        const Vec3 z = q.a.X_WS.R.col(2);
        const Vec3 across = z.cross(Vec3(q.b.X_WS.R.col(2)));
        n = across.norm() > 1e-6 ? Vec3(across.normalized()) : any_perpendicular(z);
        if (n.dot(q.a.X_WS.p - q.b.X_WS.p) < 0) n = -n;
    }
    const Real sine = q.a.X_WS.R.col(2).cross(q.b.X_WS.R.col(2)).norm();
    if (sine < kParallel && add_pair(q, n, a, b)) return NarrowResult::kTouching;
    return add_point(q, n, NormalOwner::kNone, c.a, a.radius, c.b, b.radius, 1);
}

}  // namespace cairn::narrow
