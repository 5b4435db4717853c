// The hidden part of World.
#pragma once

#include "engine/world_data.hpp"

namespace cairn {

struct World::Impl {
    WorldData data;

    // What a handle names; throws Error if it is stale.
    const Body& body(BodyId id) const;
    Body& body(BodyId id) { return const_cast<Body&>(static_cast<const Impl*>(this)->body(id)); }
    const Joint& joint(JointId id) const;
    Joint& joint(JointId id) { return const_cast<Joint&>(static_cast<const Impl*>(this)->joint(id)); }
};

}  // namespace cairn
