// Reference methods that make projected Gauss-Seidel converge faster; for comparison.
//
// NNCG (Silcowitz, Niebe, Erleben 2010, "A nonsmooth nonlinear conjugate gradient method for interactive contact force problems"): a sweep
// is read as a gradient step, ∇f = −(λ after − λ before), and λ is carried on along the directions of Fletcher and Reeves:
//     β = ‖∇f_k‖² / ‖∇f_{k−1}‖²;  β > 1: p ← 0, a restart;  else λ ← λ + β p,  p ← β p − ∇f_k
// The next sweep projects λ back on its bounds. (Over-relaxation is SiModel::relaxation.)
#pragma once

#include "solver/contact_rows.hpp"

namespace cairn {

// Notes where λ stands and forgets the directions. Sizes the scratch vectors of the pool.
void nncg_begin(ContactPool& pool, BlockRange range);

// After a sweep over all rows: carries λ and the velocities on. `gradient` keeps ‖∇f‖² from call to call; 0 before the first.
void nncg_carry_on(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real& gradient);

}  // namespace cairn
