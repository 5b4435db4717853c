// Shapes at random and what every manifold must satisfy, for the tests of the narrow phase.
#pragma once

#include "collision/hull.hpp"
#include "collision/narrow_phase.hpp"

#include <random>
#include <string>
#include <vector>

namespace narrow_test {

using namespace cairn;

using Random = std::mt19937_64;

inline Real uniform(Random& r, Real lo, Real hi) {
    return std::uniform_real_distribution<Real>(lo, hi)(r);
}

inline Vec3 random_direction(Random& r) {
    for (;;) {
        const Vec3 v(uniform(r, -1, 1), uniform(r, -1, 1), uniform(r, -1, 1));
        const Real l = v.norm();
        if (l > 0.1 && l < 1) return v / l;
    }
}

inline Mat3 rotation(const Vec3& axis, Real angle) {
    return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}
inline Mat3 random_rotation(Random& r) {
    return rotation(random_direction(r), uniform(r, 0, kPi)) * rotation(random_direction(r), uniform(r, 0, kPi));
}

inline Transform at(Real x, Real y, Real z, const Mat3& R = Mat3::Identity()) {
    return {R, Vec3(x, y, z)};
}

inline Shape hull_of(Random& r, int points, Real radius) {
    std::vector<Vec3> p;
    for (int i = 0; i < points; ++i) p.push_back(radius * random_direction(r));
    return Shape::convex(p);
}

inline Shape prism(int sides, Real radius, Real half_height) {
    std::vector<Vec3> p;
    for (int i = 0; i < sides; ++i)
        for (const Real z : {-half_height, half_height})
            p.emplace_back(radius * std::cos(2 * kPi * i / sides), radius * std::sin(2 * kPi * i / sides), z);
    return Shape::convex(p);
}

inline Shape cube_hull(const Vec3& h) {
    std::vector<Vec3> p;
    for (int i = 0; i < 8; ++i) p.emplace_back(i & 1 ? h.x() : -h.x(), i & 2 ? h.y() : -h.y(), i & 4 ? h.z() : -h.z());
    return Shape::convex(p);
}

// A flat square grid of triangles in z = height, from −cells/2 to cells/2 in units of `cell`.
inline Shape grid_mesh(int cells, Real cell, Real (*height)(Real, Real)) {
    std::vector<Vec3> v;
    std::vector<std::array<int, 3>> t;
    for (int j = 0; j <= cells; ++j)
        for (int i = 0; i <= cells; ++i) {
            const Real x = (i - cells / 2.0) * cell, y = (j - cells / 2.0) * cell;
            v.emplace_back(x, y, height(x, y));
        }
    const int row = cells + 1;
    for (int j = 0; j < cells; ++j)
        for (int i = 0; i < cells; ++i) {
            const int a = j * row + i;
            t.push_back({a, a + 1, a + row + 1});
            t.push_back({a, a + row + 1, a + row});
        }
    return Shape::triangle_mesh(v, t);
}

struct Outcome {
    NarrowResult result = NarrowResult::kFailed;
    std::vector<Manifold> manifolds;
    NarrowStats stats;
    PairCache cache;
};

inline Outcome collide(const Shape& a, const Transform& X_A, const Shape& b, const Transform& X_B, Real margin,
                       const PairCache& cache = {}) {
    Outcome o;
    o.cache = cache;
    o.result = collide_shapes({&a, X_A}, {&b, X_B}, margin, o.cache, o.manifolds, o.stats);
    return o;
}

inline Real deepest(const Manifold& m) {
    Real d = m.points[0].separation;
    for (int i = 1; i < m.count; ++i) d = std::min(d, m.points[i].separation);
    return d;
}

// Support of a shape by its definition, independent of the code under test.
inline Real support_of(const Shape& s, const Transform& X, const Vec3& d) {
    const Vec3 l = X.R.transpose() * d;
    Real local = 0;
    switch (s.type) {
        case ShapeType::kSphere:
            local = s.radius * d.norm();
            break;
        case ShapeType::kBox:
            local = l.cwiseAbs().dot(s.half_extents);
            break;
        case ShapeType::kCapsule:
            local = std::abs(l.z()) * s.half_height + s.radius * d.norm();
            break;
        case ShapeType::kCylinder:
            local = std::abs(l.z()) * s.half_height + s.radius * std::hypot(l.x(), l.y());
            break;
        case ShapeType::kHull:
            local = -1e300;
            for (const Vec3& v : s.hull->vertices()) local = std::max(local, l.dot(v));
            break;
        default:
            break;
    }
    return d.dot(X.p) + local;
}

inline Real separation_along(const Shape& a, const Transform& X_A, const Shape& b, const Transform& X_B, const Vec3& n) {
    return -support_of(a, X_A, -n) - support_of(b, X_B, n);
}

// What is wrong with an outcome, or nothing.
inline std::string flaw(const Outcome& o, Real margin, Real size) {
    if (o.result == NarrowResult::kTouching && o.manifolds.empty()) return "touching without a manifold";
    if (o.result != NarrowResult::kTouching && !o.manifolds.empty()) return "a manifold without touching";
    for (const Manifold& m : o.manifolds) {
        if (!(std::abs(m.n.norm() - 1) < 1e-9)) return "normal not unit";
        if (m.count < 1 || m.count > kMaxManifoldPoints) return "count out of range";
        for (int i = 0; i < m.count; ++i) {
            const ManifoldPoint& p = m.points[i];
            if (!is_finite(p.core_a) || !is_finite(p.core_b) || !std::isfinite(p.separation)) return "point not finite";
            if (!(p.separation < margin)) return "point beyond the margin";
            // Rounding of a few products of coordinates up to `size` and of the radii.
            const Real far = size + p.radius_a + p.radius_b + p.core_a.norm();
            if (!(std::abs(m.n.dot(p.core_a - p.core_b) - p.radius_a - p.radius_b - p.separation) < 1e-13 * far))
                return "separation does not follow from the points";
            for (int k = 0; k < i; ++k)
                if (m.points[k].feature == p.feature) return "feature twice";
        }
    }
    for (std::size_t i = 0; i < o.manifolds.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (o.manifolds[i].sub_key == o.manifolds[k].sub_key) return "sub_key twice";
    return "";
}

}  // namespace narrow_test
