// Natural-map residuals: how far impulses and velocities are from a solution, whatever found them.
//
// With x the impulse of a row, b the velocity that it aims at, w = G v − b, r > 0 its effective mass 1/S and P the projection on its bounds
// (x >= 0 of a normal row; ±μ λ_N or the cone of friction, λ_N the present normal impulse; none of a joint's), the row's residual is
//     |x − P(x − r w)| / r   [m/s]
// zero exactly where w = 0 inside the bounds, w >= 0 at a lower and w <= 0 at an upper one: 0 <= x ⊥ w >= 0 for normal rows. It asks for no
// history, so it compares solvers that stop by different measures. Source: the natural map of a variational inequality (Eaves 1971;
// Facchinei and Pang 2003, 1.5), by rows; divided by r it is the velocity that one more visit of the row would change.
//
// Rows of a joint's angles have w in [1/s]: theirs is times ρ, ρ² = (1/m_A + 1/m_B) / S, the radius of gyration about the row's axis. No
// allocation.
#pragma once

#include "solver/contact_models.hpp"
#include "solver/joint_rows.hpp"
#include "solver/measures.hpp"

namespace cairn {

// What contact rows aim at: the second solve of a substep, or, with `textbook`, its one solve.
// `x`: impulses of the substep so far, by point of the pool. Bounds of friction are those of `friction`.
void add_contact_residual(const ContactPool& pool, BlockRange range, const std::vector<PointImpulse>& x, const SolverBodies& bodies,
                          FrictionModel friction, const RowTargets* textbook, ResidualMeasure& measure);

// Torsional and rolling friction (solver/spin_rows.hpp), with the present impulses of the pool; times the row's arm.
void add_spin_residual(const ContactPool& pool, BlockRange spins, const SolverBodies& bodies, ResidualMeasure& measure);

// Rows must be built (build_joints). With `biased` they aim at −bias, else at 0.
void add_joint_residual(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, bool biased,
                        ResidualMeasure& measure);

}  // namespace cairn
