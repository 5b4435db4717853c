// How far apart shapes may be at the start of a step and still touch within it: the speculative margin.
#pragma once

#include "engine/world_data.hpp"

#include <algorithm>

namespace cairn {

// Share of a shape's size within which a neighbour is looked at even if nothing moves: so that a body rocking by a hair keeps its points.
constexpr Real kMarginShare = 0.02;

// The part of a shape's reach [m] that is not its body's linear way.
inline Real reach_without_way(const WorldData& world, const Body& body, const ShapeRecord& shape, Real dt) {
    if (body.type == BodyType::kStatic) return 0;
    const Real rest = body.is_awake() ? external_acceleration(world, body).norm() * dt * dt : 0;
    return kMarginShare * shape.size + body.w.norm() * dt * shape.spin_radius + rest;
}

// The margin [m] of a pair: relative way plus what else either may move.
inline Real pair_margin(const ShapeMotion& a, const ShapeMotion& b, Real dt) {
    return (a.v - b.v).norm() * dt + a.reach + b.reach;
}

}  // namespace cairn
