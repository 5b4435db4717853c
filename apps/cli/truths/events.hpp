// What must have happened in a run, whatever its error: a scene in which nothing moves has no penetration.
#pragma once

#include "apps/cli/truths.hpp"

namespace cairn::cli {

// Bodies (jointed groups count as one, those tied to the world not at all) that are slower than `slow` [m/s] at the last sample, if that is
// 0.05 or less also at the one before, and of them those that nothing bears within 2 cm, or within half their radius.
struct SupportCount {
    int hovering = 0, of = 0;
};
SupportCount supported(const Scene& scene, const History& history, Real slow);

// Why a run that reached its end does not count; empty if it does. In every scene: what has touched nothing is on its parabola (flight.hpp;
// a hundredth may be off), what is at rest lies on something (a hundredth may not). By a scene's name: what is hit, moves; what is in a
// container, stays in it and settles; chains fall as chains do; dominoes fall over; the board of a maze turns as it is told.
std::string missing_event(const Scene& scene, const History& history);

}  // namespace cairn::cli
