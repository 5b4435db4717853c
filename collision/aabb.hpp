// Axis-aligned bounding box in the world frame [m].
#pragma once

#include "engine/base/math.hpp"

namespace cairn {

struct Shape;

struct Aabb {
    Vec3 lo = Vec3::Zero();
    Vec3 hi = Vec3::Zero();

    bool overlaps(const Aabb& b) const {
        return lo.x() <= b.hi.x() && b.lo.x() <= hi.x() && lo.y() <= b.hi.y() && b.lo.y() <= hi.y() && lo.z() <= b.hi.z() && b.lo.z() <= hi.z();
    }
    bool contains(const Aabb& b) const { return (lo.array() <= b.lo.array()).all() && (b.hi.array() <= hi.array()).all(); }
    Aabb grown(Real margin) const { return {lo - Vec3::Constant(margin), hi + Vec3::Constant(margin)}; }
    // The smallest box that holds this one and this one moved by d.
    Aabb swept(const Vec3& d) const { return {lo + d.cwiseMin(0.0), hi + d.cwiseMax(0.0)}; }
    Aabb merged(const Aabb& b) const { return {lo.cwiseMin(b.lo), hi.cwiseMax(b.hi)}; }
    Real half_area() const {
        const Vec3 d = hi - lo;
        return d.x() * d.y() + d.y() * d.z() + d.z() * d.x();
    }
};

// The tight box of a shape whose frame stands at X_WS. Planes are unbounded: asking for theirs is a logic error (see BroadPhase::add_plane).
Aabb shape_aabb(const Shape& shape, const Transform& X_WS);

}  // namespace cairn
