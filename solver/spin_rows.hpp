// Torsional and rolling friction: what a contact's area does against turning, where the engine knows only points.
//
// Per manifold, with n its unit normal, ω = ω_A − ω_B, Λ the sum of its normal impulses, and K = I_A⁻¹ + I_B⁻¹:
//     torsion  w = nᵀω             |τ_n| <= c_t Λ      S = nᵀ K n
//     rolling  w = ω − n nᵀω       ‖τ_t‖ <= c_r Λ      (a disc: the moment opposes the rolling, whatever its direction)
// G = [0, dᵀ, 0, −dᵀ] for an axis d, so an impulse τ [N m s] turns A by +I_A⁻¹ τ and B by −I_B⁻¹ τ. c_t and c_r are lengths [m]. All in
// World. Sources: Johnson 1985, Contact Mechanics, ch. 8 (rolling moment c_r N); Trinkle et al. 1997 (the friction of a soft finger).
#pragma once

#include "solver/contact_rows.hpp"

namespace cairn {

// Takes the rows of a range of blocks, built like the contacts' own; their blocks must be.
void build_spins(ContactPool& pool, BlockRange spins, const SolverBodies& bodies);

// The moment that a row's sweep leaves it with [N m s]: from its present one, the bodies' ω_A − ω_B and Λ. Torsion by its row, rolling by
// projected gradients on the disc; with equal moments that is the solution.
Vec3 spin_step(const SpinRow& row, const Vec3& n, const Vec3& turning, Real load);
Vec3 turning_rate(const ContactBlock& block, const SolverBodies& bodies);
Real normal_impulse(const ContactPool& pool, const ContactBlock& block);

// The stages of a solve, each after the contacts' one of that name (solver/contact_rows.hpp). The first solve bears half of the last
// substep's moment and does not solve for it.
void scale_warm_spins(ContactPool& pool, BlockRange spins, Real scale);
void warm_start_spins_first(ContactPool& pool, BlockRange spins, SolverBodies& bodies);
void warm_start_spins_second(ContactPool& pool, BlockRange spins, SolverBodies& bodies);
void warm_start_spins_all(ContactPool& pool, BlockRange spins, SolverBodies& bodies);
// What a manifold that ended the first solve without normal impulse was given goes back.
void hold_spins(ContactPool& pool, BlockRange spins, SolverBodies& bodies);
// One sweep; bounds from the present normal impulses. Returns the largest velocity change of a contact point that it made [m/s].
Real sweep_spins(ContactPool& pool, BlockRange spins, SolverBodies& bodies);
void close_spin_substep(ContactPool& pool, BlockRange spins);

}  // namespace cairn
