// From where on `cairn diagnose` calls something wrong, and what it takes for a cause. All in one place, each with its reason.
#pragma once

#include "engine/base/math.hpp"

namespace cairn::cli::limits {

// Symptoms.

// [s], at most a quarter of the run: small gaps and overlaps of a scene put together by hand close, and are no creep.
constexpr Real kSettle = 0.5;
// Of a body's radius, that one which should rest may move after that. Solved well it moves by 1e-9; a thousandth is seen in close-ups and
// says that something is worked against.
constexpr Real kMove = 1e-3;
// The same, from which on it has fallen rather than crept.
constexpr Real kFall = 0.5;
// Of the longest arm of a joint, by which its anchors may be apart, and [rad], by which its bodies may be turned against each other: a
// hundredth is seen.
constexpr Real kStretch = 1e-2;
constexpr Real kTwist = 1e-2;
// Of a body's least extent, by which it may stay sunk into another one. Solvers leave micrometres; drawn at this, shapes visibly overlap.
constexpr Real kSink = 0.05;

// Causes.

// Of the least extent of the thinner body: a deeper overlap at the start is no inaccuracy of the file. It is what kSink calls sunk.
constexpr Real kOverlap = 0.05;
// Heavier body on lighter one: from here on the impulses that sweeps have to bring down are an order beyond those of one sweep.
constexpr Real kMassRatio = 10;
// [m/s]: residual of a row above which a solve was not brought to its end: sweeps stop by themselves at 1e-4.
constexpr Real kResidual = 1e-3;
// Of the sweeps that a step may take: one of the two solves of a substep may come to its end while the other is cut off.
constexpr Real kAtCap = 0.75;
// Of the steps of sequential impulses, that end at the cap of their sweeps when it is the cap that ends them.
constexpr Real kCapped = 0.5;
// Of a body's least extent, that gravity makes it fall in a step: from here on a step sees the world in other places than it is.
constexpr Real kFallPerStep = 0.02;
// Of a body's least extent, that it goes in a step; and [rad], by which it turns.
constexpr Real kWayPerStep = 0.5;
constexpr Real kTurnPerStep = 0.5;
// A slope that is as steep as this share of μ already slides by rounding.
constexpr Real kSteep = 0.99;
// Normals of what bears a body point one way if their cosine is at least this: then they bear it as one plane does.
constexpr Real kOnePlane = 0.99;
// Of a body's radius, by which a centre of mass may be inside its support and yet stand on an edge.
constexpr Real kEdge = 1e-3;
// Of its length, by which what joins two places may be too short for them.
constexpr Real kReach = 1e-3;

}  // namespace cairn::cli::limits
