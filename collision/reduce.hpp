// The choice of at most four of the points of a face contact.
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>

namespace cairn {

// A point of contact of an incident feature with a reference face.
struct Candidate {
    Vec3 core = Vec3::Zero();  // on the incident side [m]
    Vec3 foot = Vec3::Zero();  // of its perpendicular on the reference face
    Real radius = 0;           // of the incident side
    Real separation = 0;       // normal·(core − foot) − radius
    std::uint32_t feature = 0;
};

constexpr int kMaxCandidates = 64;

// Moves the chosen ones to the front and returns their number (<= 4): the deepest, then those that span the largest area. `depth_slack`
// [m]: points that much above the deepest count as equally deep; near ties go to the earlier candidate, so small changes do not change the
// choice.
int reduce(Candidate* candidates, int count, const Vec3& normal, Real depth_slack);

}  // namespace cairn
