// y' = f(t, y) to nearly the last digit: modified midpoint steps, extrapolated to step zero (Gragg 1965; Bulirsch, Stoer 1966), with step
// control. For references only: it allocates, and it spends what it must.
#pragma once

#include "engine/base/math.hpp"

#include <functional>
#include <vector>

namespace cairn::cli {

using Derivative = std::function<void(Real t, const std::vector<Real>& y, std::vector<Real>& dy)>;

// Takes y from t0 to t1 > t0. `tolerance`: of the last correction of each step, relative to 1 + |y| of each component; what is left after
// it is smaller. Throws Error if no step is small enough (the right-hand side is not smooth).
void integrate(const Derivative& f, Real t0, Real t1, Real tolerance, std::vector<Real>& y);

}  // namespace cairn::cli
