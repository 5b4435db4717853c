// Whether a run counts at all, whatever its error: what no motion may do, from the states alone.
#pragma once

#include "apps/cli/truths.hpp"

namespace cairn::cli {

// Largest rise of the energy over its start, relative to the largest of the starting kinetic energy, the fall in potential energy and the
// weights times the bodies' radii. 0 for scenes that are driven by forces, motions or restitution over 1.
Real energy_gain(const Scene& scene, const History& history);

// Whether a truth can be asked at all: the states reach the end of the scene, and all are finite.
bool is_whole(const Scene& scene, const History& history);

// Why the run does not count: something that is not finite, gone or faster than anything could be, fallen through level ground, energy from
// nothing. Empty if it does.
std::string unsound(const Scene& scene, const History& history);

}  // namespace cairn::cli
