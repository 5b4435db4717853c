// Bodies that can have touched nothing yet are on their parabola: whatever an engine does with contacts, it must let things fall.
#pragma once

#include "apps/cli/truths.hpp"

namespace cairn::cli {

struct Flight {
    int off = 0;     // free bodies, or groups of jointed ones by their centre of mass, that were off their parabola
    int of = 0;      // of how many
    Real worst = 0;  // [m], farthest that one was from it
};

// Off is what is farther from p₀ + v₀ t + g t² / 2 than a hundredth of its way, g t / 60 s (a first-order step of 1/60 s is half of that
// off) and a millimetre. Asked for the first two seconds, and of each body until anything may have touched it, on the safe side: spheres
// around bodies; and what may have been touched may be anywhere that twice the greatest speed of a fall takes it.
Flight free_flight(const Scene& scene, const History& history);

}  // namespace cairn::cli
