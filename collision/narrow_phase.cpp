#include "collision/narrow_phase.hpp"

#include "collision/narrow_pair.hpp"

#include <algorithm>
#include <utility>

namespace cairn {
namespace {

using narrow::Query;

// Which of two shapes comes first within the narrow phase.
int rank(ShapeType type) {
    switch (type) {
        case ShapeType::kSphere:
            return 0;
        case ShapeType::kCapsule:
            return 1;
        case ShapeType::kCylinder:
            return 2;
        case ShapeType::kBox:
            return 3;
        case ShapeType::kHull:
            return 4;
        case ShapeType::kPlane:
            return 5;
        case ShapeType::kMesh:
            return 6;
    }
    return 7;
}

bool is_finite_pose(const Transform& X) {
    return std::isfinite(X.R.sum() + X.p.sum());
}

NarrowResult answer(Query& q) {
    switch (q.b.shape->type) {
        case ShapeType::kPlane:
            return narrow::collide_with_plane(q);
        case ShapeType::kMesh:
            return narrow::collide_with_mesh(q);
        default:
            break;
    }
    const ShapeType a = q.a.shape->type, b = q.b.shape->type;
    if (a == ShapeType::kSphere) return narrow::collide_sphere(q);
    if (a == ShapeType::kCapsule && b == ShapeType::kCapsule) return narrow::collide_capsules(q);
    if (a == ShapeType::kCapsule && b == ShapeType::kBox) return narrow::collide_capsule_box(q);
    if (a == ShapeType::kBox && b == ShapeType::kBox) return narrow::collide_boxes(q);
    return narrow::collide_convex(q);
}

void move_back(Manifold& m, const Vec3& origin, bool flipped) {
    for (int i = 0; i < m.count; ++i) {
        ManifoldPoint& p = m.points[i];
        p.core_a += origin;
        p.core_b += origin;
        if (flipped) {
            std::swap(p.core_a, p.core_b);
            std::swap(p.radius_a, p.radius_b);
        }
    }
    if (!flipped) return;
    m.n = -m.n;
    if (m.owner == NormalOwner::kA) {
        m.owner = NormalOwner::kB;
    } else if (m.owner == NormalOwner::kB) {
        m.owner = NormalOwner::kA;
    }
}

bool is_sound(const Manifold& m) {
    if (!(std::abs(m.n.squaredNorm() - 1) < 1e-6) || m.count < 1) return false;
    Real sum = 0;
    for (int i = 0; i < m.count; ++i) {
        const ManifoldPoint& p = m.points[i];
        sum += p.core_a.sum() + p.core_b.sum() + p.radius_a + p.radius_b + p.separation;
    }
    return std::isfinite(sum);
}

// The query in the order and frame of narrow_pair.hpp, and back.
NarrowResult collide_ordered(const PlacedShape& a, const PlacedShape& b, bool flipped, Real margin, const Mat3& R_cache, PairCache& cache,
                             std::vector<Manifold>& out, NarrowStats& stats) {
    const Vec3 origin = a.X_WS.p;
    Query q{{a.shape, {a.X_WS.R, Vec3::Zero()}},
            {b.shape, {b.X_WS.R, b.X_WS.p - origin}},
            margin,
            0,
            Vec3::Zero(),
            false,
            flipped,
            true,
            out,
            stats};
    const bool bounded = !b.shape->is_static_only();
    if (bounded && !cache.axis.isZero(0)) {
        q.axis = R_cache * cache.axis;
        if (flipped) q.axis = -q.axis;
        q.was_touching = !cache.is_apart();
    }
    q.size = bounded ? std::min(shape_size(*a.shape), shape_size(*b.shape)) : shape_size(*a.shape);

    const std::size_t before = out.size();
    const NarrowResult result = answer(q);
    if (result == NarrowResult::kFailed) return result;
    for (std::size_t i = before; i < out.size(); ++i) {
        if (!is_sound(out[i])) return narrow::failed(q);
        move_back(out[i], origin, flipped);
    }
    const bool is_apart = q.may_cache && result == NarrowResult::kSeparated && !q.axis.isZero(0);
    cache.gap = is_apart ? margin : PairCache::kNotApart;
    if (q.may_cache) cache.axis = R_cache.transpose() * (flipped ? Vec3(-q.axis) : q.axis);
    return result;
}

}  // namespace

NarrowResult collide_shapes(const PlacedShape& a, const PlacedShape& b, Real margin, PairCache& cache, std::vector<Manifold>& out,
                            NarrowStats& stats) noexcept {
    ++stats.queries;
    if (cache.is_apart()) {
        const Vec3 n = a.X_WS.R * cache.axis;
        const Real gap = -support(a, -n) - support(b, n);
        if (gap >= margin) {  // false for poses that are not finite
            cache.gap = gap;
            ++stats.separating_axis_hits;
            return NarrowResult::kSeparated;
        }
    }
    if (!is_finite_pose(a.X_WS) || !is_finite_pose(b.X_WS) || !std::isfinite(margin)) {
        ++stats.failures;
        return NarrowResult::kFailed;
    }
    const std::size_t before = out.size();
    NarrowResult result;
    try {
        const bool spheres = a.shape->type == ShapeType::kSphere && b.shape->type == ShapeType::kSphere;
        const bool flipped = rank(a.shape->type) > rank(b.shape->type);
        result = spheres ? narrow::collide_spheres(a, b, margin, out)
                         : collide_ordered(flipped ? b : a, flipped ? a : b, flipped, margin, a.X_WS.R, cache, out, stats);
    } catch (...) {  // out of memory
        ++stats.failures;
        result = NarrowResult::kFailed;
    }
    if (result == NarrowResult::kFailed) out.resize(before);
    return result;
}

}  // namespace cairn
