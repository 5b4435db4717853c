// Impacts with restitution, split at their own time inside the substep.
//
// A row with e > 0 whose gap closes at τ < h arrives there with −w (gap and relative velocity taken along the parabola of the external
// accelerations) and leaves with e w, so at the end of the drift the gap is to be e w (h − τ) + a (h − τ)²/2 and its rate e w + a (h − τ):
// the row's `lift` and `bounce`. So the error of a bounce does not depend on where in the step it falls. Where the normal is that between
// two core points (spheres), the whole block is built along the normal that it has at τ: an oblique impact is that of the textbook,
// Δv = M⁻¹(nλ + tα) with |α| <= μ λ and the slip's direction at τ, but for the way that friction changes between τ and h.
#pragma once

#include "solver/contact_rows.hpp"

namespace cairn {

// Sets lift and bounce of each row of the range with e > 0. `along_slip`: friction's first tangent follows the slip (not where tangents are
// meant to stay).
void predict_bounces(ContactPool& pool, BlockRange range, const SolverBodies& bodies, Real h, bool along_slip);

}  // namespace cairn
