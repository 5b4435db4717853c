// Direct solver of contact islands: an active-set Newton method with a sparse factorisation, in the same substeps as sequential impulses.
//
// A solve looks for the impulses λ and velocities v with
//     M (v − v₀) = Gᵀ (λ − λ₀),   w = G v − b,   λ = proj(λ − w)   per row, proj onto [0, ∞) or [−μ λ_N, μ λ_N]
// by augmented Lagrangians (Hestenes 1969, Powell 1969): with the multipliers λ̂ and the friction bounds held, v minimises the convex,
// piecewise quadratic  ½ (v − v₀)ᵀ M (v − v₀) − λ₀ᵀ G v … + Σ ‖proj(λ̂ − D w)‖² / 2D  by Newton's method with a line search,
//     H = M + Σ_active D Gᵀ G,     one 6 × 6 block row a body,
// then λ̂ = proj(λ̂ − D w), bounds from the new λ_N, until the natural residual max ‖λ − proj(λ − m w)‖ / m is below a tolerance. The weight
// D only conditions: the multipliers carry the load from step to step, so what rests needs no factorisation at all.
// Sources: Alart and Curnier 1991 (augmented Lagrangian for contact), Qi and Sun 1993 (semismooth Newton); the composition is ours.
#pragma once

#include "engine/base/hash.hpp"
#include "solver/block_cholesky.hpp"
#include "solver/si.hpp"

#include <cstdint>
#include <utility>
#include <vector>

namespace cairn {

struct DirectSettings {
    int substeps = 4;
    Real tolerance = 1e-11;             // [m/s], natural residual at which a solve ends
    int most_updates = 8;               // of the multipliers, per solve
    int most_newton_steps = 16;         // per update
    int most_factorisations = 1000000;  // in a step
    Real start_tolerance = 1e-7;        // [m/s], with which it need not begin, and may end where rounding lets it fall no further
    Real rest_tolerance = 1e-9;         // [m/s], with which it need not begin in a step after one that had to
    Real good_contraction = 0.03;       // of the residual in an update: below start_tolerance, a slower one is not gone on with
    Real weight = 1e6;                  // D in units of a row's effective mass
    Real contact_push = 0.1;            // share of a penetration that a substep takes back
    Real rebuild_angle = 1e-3;          // [rad], as SiSettings
    Team* team = nullptr;               // that solves it together; the result is the same
    int rescue_sweeps = 0;              // of sequential impulses over a solve that did not converge; 0: the step is taken back instead
};

// What an island keeps from step to step, and the solver's memory.
class DirectCache {
public:
    // What the next solve depends on.
    void add_to(Hasher& hasher) const;

    // Makes the ordering anew if the island's pairs are others than the last time, and says so. `pairs` are dynamic bodies counted from the
    // island's first.
    bool set_pattern(int bodies, const std::vector<std::pair<int, int>>& pairs);

    BlockCholesky factor;
    bool has_factor = false;
    Real weight_scale = 1;              // on DirectSettings::weight
    bool disturbed = false;             // the last step has changed impulses, some of which may have changed velocities
    bool polished = false;              // what it left has been solved for once more
    std::vector<char> factored_active;  // rows in H when it was factorised
    std::vector<std::pair<int, int>> pairs;

private:
    int bodies_ = -1;
};

struct DirectReport {
    bool converged = true;    // every solve
    bool taken_back = false;  // the island is as it was before the step
    bool stands = false;      // all poses are as they were, all velocities zero, warm impulses unchanged: the next step will be the same
    std::uint64_t factorisations = 0;
    std::uint64_t newton_steps = 0;
    std::uint64_t passes = 0;  // over the rows
    SiReport si;               // sweeps of solves that did not converge, and rotor calls
    Real residual = 0;         // [m/s], largest natural residual that a solve ended with
};

// Steps an island without joints and without restitution by dt, as solve_island_si does; or leaves it as it was, see `rescue_sweeps`.
DirectReport solve_island_direct(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island, Real dt,
                                 const DirectSettings& settings, DirectCache& cache, IslandProbe* probe = nullptr);

}  // namespace cairn
