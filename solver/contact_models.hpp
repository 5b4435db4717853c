// Sweeps of the textbook method over contact rows, for every model of solver/si_model.hpp: clear rather than fast.
// The models of the default substep, and their speed, are in solver/contact_rows.hpp.
#pragma once

#include "solver/contact_rows.hpp"
#include "solver/si_model.hpp"
#include "solver/softness.hpp"

#include <limits>

namespace cairn {

// What the normal rows of a sweep aim at: G v = −β C / h (at most `push`) where C < 0, −C / h where a gap would close, a bounce.
struct RowTargets {
    Real h = 0;                                         // [s]
    Real beta = 0;                                      // share of a penetration taken back
    Real push = std::numeric_limits<Real>::infinity();  // [m/s]
    Softness soft{0, 1, 0};                             // of penetrating rows; its rate is not used
};

// One Gauss-Seidel sweep over the normal rows. Returns a bound of the largest velocity change of a row [m/s].
Real sweep_normals(ContactPool& pool, BlockRange range, SolverBodies& bodies, const SiModel& model, const RowTargets& targets);

// One sweep over the friction rows, bounds from the present normal impulses. Returns likewise.
Real sweep_frictions(ContactPool& pool, BlockRange range, SolverBodies& bodies, const SiModel& model);

// What a normal row aims at [m/s].
Real target_velocity(const NormalRow& row, const SiModel& model, const RowTargets& targets);

}  // namespace cairn
