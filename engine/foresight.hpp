// Features that will touch within the step.
//
// Manifolds hold the features that are nearest at the start of a step. Where a body turns, or comes from afar, others may be first to
// arrive in it, and nothing would hold them: they sink in until the next step finds them. So the narrow phase is asked once more, with the
// poses that the bodies' velocities lead to,
// - when the shapes meet, for a pair that is apart and will meet within the step: what it says then takes the place of what it said of the
//   start;
// - at the step's end, for a pair that turns and touches, will meet, or is so near that turning alone may bring other features down: points
//   that it finds there and that are clear of each other at the start are added, as manifolds of their own. Not where what is lowest then
//   was found already.
// The points are material, so that they serve at the present poses. Pairs that do neither are not asked twice. Internal to the engine.
#pragma once

#include "engine/world_data.hpp"

namespace cairn {

struct Foresight {
    Real meeting = 0;     // [s], when the shapes meet within the step, if they go far until then; 0: they do not
    bool at_end = false;  // whether other features may come down until the step's end
};

// How A's features turn against B's.
struct Turning {
    Vec3 rate = Vec3::Zero();  // [rad/s]; a capsule's or cylinder's turn about its own axis does not count
    bool has_ball = false;     // which has the same features however it turns
};
Turning turning_of(const Body& a, const ShapeRecord& shape_a, const Body& b, const ShapeRecord& shape_b);

// `found`: at the present poses. `size`: of the smaller shape [m].
Foresight foresight_of(const Body& a, const Body& b, const Turning& turning, const std::vector<Manifold>& found, Real size, Real dt);

// Whether other features than those of `found`, which are at the present poses, may touch at the step's end: for a pair that touches by an
// edge of each they may; over a face, if something is below it then that is lower than what was found; capsules' axes must come side by
// side.
bool may_come_down(const Body& a, const ShapeRecord& shape_a, const Body& b, const ShapeRecord& shape_b, const Turning& turning,
                   const std::vector<Manifold>& found, Real dt);

// The body's frame after t at its present velocities.
Transform pose_after(const Body& body, Real t);

// Manifolds that were found with the bodies at Y_WA, Y_WB, at the present poses X_WA, X_WB.
void bring_back(std::vector<Manifold>& foreseen, const Transform& X_WA, const Transform& X_WB, const Transform& Y_WA,
                const Transform& Y_WB);

// Adds what `found` does not have yet: points of features of their own that are clear at the present poses.
void add_foreseen(std::vector<Manifold>& found, const std::vector<Manifold>& foreseen);

}  // namespace cairn
