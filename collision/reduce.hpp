// The choice of at most four of the points of a face contact.
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>

namespace cairn {

// A point of contact of an incident feature with a reference face. Not initialised: queries keep arrays of them on the stack.
struct Candidate {
    Vec3 core;        // on the incident side [m]
    Vec3 foot;        // of its perpendicular on the reference face
    Real radius;      // of the incident side
    Real separation;  // normal·(core − foot) − radius
    std::uint32_t feature;
};

constexpr int kMaxCandidates = 64;

// Moves the chosen ones to the front and returns their number (<= 4): the deepest, then those that span the largest area. `depth_slack`
// [m]: points that much above the deepest count as equally deep; near ties go to the earlier candidate, so small changes do not change the
// choice.
int reduce(Candidate* candidates, int count, const Vec3& normal, Real depth_slack);

}  // namespace cairn
