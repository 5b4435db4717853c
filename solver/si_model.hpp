// The models of sequential impulses that can be chosen: the textbook's steps, each on its own, beside the default.
//
// With λ the accumulated impulse of a normal row in a step, S = G M⁻¹ Gᵀ and Δ = −S⁻¹ (G v − target) the correction that makes the row's
// velocity right, a sweep sets (`Clamp`)
//     kNone           λ ← λ + Δ              an equation: the contact also pulls
//     kPerIteration   λ ← λ + max(Δ, 0)      no correction pulls, so none can be taken back
//     kAccumulated    λ ← max(λ + Δ, 0)      the sum does not pull: projected Gauss-Seidel (Catto 2005)
// Friction of a point (`FrictionModel`), α its impulses along t₁ and t₂ = n × t₁, bounded by the present λ:
//     kNone           no rows
//     kOneDirection   |α₁| <= μ λ, t₁ = v_T / ‖v_T‖ at the start of the step; any fixed perpendicular of n where v_T = 0; nothing along t₂
//     kPyramidFixed   |α₁|, |α₂| <= μ λ, t₁ a fixed perpendicular of n
//     kPyramid        the same, t₁ along the slip, kept where that is slow
//     kCone           ‖α‖ <= μ λ, along the slip velocity (maximum dissipation)
#pragma once

#include <cstdint>

namespace cairn {

// How a position error (penetration, joint separation) is worked off.
//   kSplit          biased solve moves the positions, a second, unbiased solve sets the velocities: no energy enters through the bias
//   kTargetVelocity Baumgarte (1972): the bias is part of the velocity, the textbook method
//   kNone           not at all: positions drift
//   kSoft           damped springs, implicit, then a sweep without them (Catto 2011, 2024)
enum class Stabilisation : std::uint8_t { kSplit, kTargetVelocity, kNone, kSoft };

enum class Clamp : std::uint8_t { kNone, kPerIteration, kAccumulated };
enum class FrictionModel : std::uint8_t { kNone, kOneDirection, kPyramidFixed, kPyramid, kCone };
enum class SweepOrder : std::uint8_t { kJointsFirst, kContactsFirst };
// kNncg accelerates the sweeps of contacts by nonlinear conjugate gradients (solver/reference_methods.hpp).
enum class SweepMethod : std::uint8_t { kPgs, kNncg };

struct SiModel {
    Clamp clamp = Clamp::kAccumulated;
    // λ C = 0: an open gap takes no impulse unless it would close within the step. Off: it is held as if it were closed.
    bool complementarity = true;
    bool warm_start = true;  // off: accumulated impulses start every substep at zero
    FrictionModel friction = FrictionModel::kPyramid;
    SweepOrder order = SweepOrder::kJointsFirst;
    SweepMethod method = SweepMethod::kPgs;
    double relaxation = 1;  // ω in (0, 2): Δ is taken ω times; over-relaxation above 1

    bool operator==(const SiModel&) const = default;
    // True if only the textbook's substep knows this model.
    bool is_textbook() const { return clamp != Clamp::kAccumulated || !complementarity || method != SweepMethod::kPgs || relaxation != 1; }
};

}  // namespace cairn
