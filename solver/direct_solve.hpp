// One solve of the direct solver. Internal to this room.
#pragma once

#include "solver/direct.hpp"

namespace cairn {

// What a solve asks of a row.
struct DirectRow {
    Real target = 0;  // b [m/s]
    Real low = 0;     // bounds of λ [N s]
    Real high = 0;
    Real start = 0;       // λ₀, in v₀ already
    Real multiplier = 0;  // λ̂
    Real weight = 0;      // D [kg]
    Real slip = 0;        // w = G v − b [m/s], of the last pass
    Real impulse = 0;     // proj(λ̂ − D w), of the last pass
    Real along = 0;       // G d of the line search
    bool active = false;  // inside its bounds
};

// A row g whose weight H has not as it was factorised.
struct DirectChange {
    int a = -1, b = -1;  // dynamic bodies of the island, or < 0
    Vec6 g_a, g_b;
    Real weight = 0;  // that is missing [kg]; < 0: is too much
};

// Working memory of a solve; kept for its size.
struct DirectScratch {
    std::vector<DirectRow> rows;   // 3 per point: normal, friction 1, friction 2
    std::vector<BodyVelocity> v0;  // per dynamic body of the island
    std::vector<Mat3> inertia_W;   // [kg m²]
    std::vector<Vec6> gradient;    // M (v − v₀) − Gᵀ (λ − λ₀)
    std::vector<Vec6> step;
    std::vector<char> active;
    std::vector<DirectChange> changes;      // rows that the factor has and the active set has not, or the other way round
    std::vector<std::vector<Vec6>> spread;  // H⁻¹ gᵀ of each of them, H as it was factorised
    int factorisations_left = 0;            // of the step
    // The island before the step.
    std::vector<BodyMotion> saved_motion;
    std::vector<BodyVelocity> saved_velocity;
    std::vector<WarmImpulse> saved_warm;
};

enum class DirectGoal { kGaps, kPush, kVelocities };

// Solves for what `goal` asks (see si.hpp for the two solves and the push) from the impulses in the pool and the velocities in `bodies`,
// which must agree; leaves both in agreement. A residual of `enough` [m/s] is left as it is. False if the residual is not below the
// tolerance in the end.
bool direct_solve(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island, DirectGoal goal, Real h,
                  const DirectSettings& settings, DirectCache& cache, DirectScratch& scratch, DirectReport& report, Real enough);

enum class Rest : std::uint8_t {
    kNo,      // it has to be solved
    kNearly,  // the same, however small its residuals: more is left than rounding leaves, and would grow
    kYes,     // the step has ended
};

// A step of what stays where it is, from the kick and the warm start of the first solve on: one pass over the points. It ends here if the
// impulses that the island starts with hold it, both solves' residuals being `enough` [m/s] at most: then they leave all velocities below
// that and no gap open that they bear upon. Where they are no more than what rounding leaves of the balance of so many impulses, no step
// could tell them from zero: zero they are, and no pose changes. Where they are little more than that, and it `may_polish`, they are to be
// solved for once more. Nothing is changed but by kYes. The second solve's impulses must be those of the first once more, so that its
// velocities are v₂ = 2 v₁ − v₀.
Rest rests(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island, Real h, const std::vector<BodyVelocity>& v0, Real enough,
           bool may_polish, DirectReport& report);

}  // namespace cairn
