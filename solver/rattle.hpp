// RATTLE with a direct solve: bodies that joints alone hold, no contacts.
//
// The equations, with q the poses, u = (v, w), a and τ the external acceleration and torque, C the joints, G = ∂C/∂q, λ impulses:
//     M u̇ = F + Gᵀ f,  C(q) = 0
// A stage of length h (RATTLE: Andersen 1983, in the form of Leimkuhler and Reich 2004; the rotor is that of solver/rotor.hpp, so the
// free motion in it is the rigid body's own):
//     kick       u ← u + h/2 M⁻¹ F
//     SHAKE      find λ such that drifting by u + M⁻¹ G(q₀)ᵀ λ ends at C(q₁) = 0 (Ryckaert, Ciccotti and Berendsen 1977)
//     drift      q₀ → q₁
//     kick       u ← u + h/2 M⁻¹ F
//     projection u ← u + M⁻¹ G(q₁)ᵀ μ with G(q₁) u = 0
// It is symmetric in time, symplectic, of 2nd order, and keeps the momenta that the joints allow. Five stages of lengths g h, g h,
// (1 − 4 g) h, g h, g h with g = 1/(4 − 4^⅓) are of 4th order (Suzuki 1990); the middle one goes backwards.
//
// Linear algebra: A = G M⁻¹ Gᵀ over the graph of joints, block-sparse LDLᵀ (solver/block_ldlt.hpp), factored once a stage, at its end:
// the projection is one solve, and the next stage's SHAKE iterates with the same factor. ∂C(q₁)/∂λ differs from h A by O(h): Broyden's
// update (1965; the form by stored steps, Kelley 1995), in the metric of A, learns the difference, so the iteration is superlinear.
// λ starts from an extrapolation: with f the joint forces, λ = h/2 (f(t₀) + h/3 s), μ = h/2 (f(t₁) − h/3 s) + O(h³) for the same slope s
// (derivation: expand the drift to h³; time symmetry gives μ), so s is read from the difference of a stage's λ and the μ before it.
// Redundant rows (closed chains, planar loops): the factor drops them by their pivots; the others hold what they ask, which is checked.
//
// Joints that are apart at the start: the gap is worked off by moving poses alone, along M⁻¹Gᵀ, at `closing_speed` at most; velocities
// keep nothing of it, so a scene that is put together wrongly glides together and gains no speed. What is left of the gap is held
// during the step: the stages solve C(q₁) = C(q₀).
//
// Substeps: the step is cut so that the fastest rate of the island turns by `turn_per_substep` at most in a substep,
//     Ω² = max over bodies of  ¼ (Σ over its joints ‖f‖ ‖r‖ / I⊥  + ‖f‖ / (m L) of a rod)  +  ‖w‖²
// where a force f at the arm r turns the body about its centre with the frequency sqrt(‖f‖ ‖r‖ / I⊥): for a chain of rods (mass m, length
// l) under tension T the sum is 12 T / (m l), its fastest mode. Five stages pay while Ω dt < turn_per_substep: then what moves fast is
// resolved. Where tension makes Ω larger, the fast modes need stability, not accuracy, and the motion is slow beside them: substeps of one
// stage, Ω h <= turn_per_stage. One stage also where nothing moves. Ω is taken from the state at the start; if the state at the end asks
// for more than twice the stages, the energy is missed, or SHAKE does not contract, the step is done again with more. All of it is a
// function of the state and the warm impulses.
#pragma once

#include "solver/rattle_rows.hpp"
#include "solver/si.hpp"

namespace cairn {

struct RattleSettings {
    int order = 4;     // 4: five stages a substep; 2: one
    int substeps = 0;  // 0: chosen; else as many
    // Of refinement, with `substeps` 0 and `order` 4: at 0 one stage, else 2^(level − 1) substeps of five stages; where tension asks for
    // more stages than that, 2^level times as many. −1: chosen.
    int level = -1;
    int max_substeps = 64;
    Real turn_per_substep = 1;  // [rad], largest Ω h of five stages
    Real turn_per_stage = 0.7;  // [rad], the same of substeps of one stage; the step is stable to 1
    Real energy_slack = 1e-3;   // a step that misses its energy by more of the kinetic one is done again with twice the substeps
    // What SHAKE may leave of a position error, relative to the largest arm: this at Ω h = 0.15 and more, and less with (Ω h)⁵ as the
    // error of the step falls.
    Real tolerance = 1e-9;
    int max_iterations = 8;      // of SHAKE
    Real closing_speed = 1;      // [m/s]
    Real drop = 1e-12;           // relative pivot below which a row counts as redundant
    Real slack = 1e-6;           // a redundant row that misses by more of the largest arm is none: no contraction
    Real max_flops = 5e6;        // of one factorisation: beyond it the island is left to others
    Real warm_step = 1.0 / 240;  // [s]: length of the substep whose impulses the pool's warm_first and warm_second are
};

enum class RattleFailure : std::uint8_t { kNone, kHasContacts, kTooCostly, kNoContraction, kNotFinite };
const char* to_string(RattleFailure failure);

struct RattleReport {
    RattleFailure failure = RattleFailure::kNone;
    int substeps = 0;
    int stages = 0;      // of a substep
    int iterations = 0;  // of SHAKE, summed over the stages
    int factorisations = 0;
    int dropped_rows = 0;  // redundant, most at a time
    int rotor_calls = 0;   // of bodies with unequal moments
    Real rate = 0;         // [rad/s]: Ω
    Real gap = 0;          // largest |C| at the start [m and 1]
    bool ok() const { return failure == RattleFailure::kNone; }
};

// Memory that steps share. Nothing in it shows in a result. One a thread.
struct RattleWorkspace {
    struct Start {
        Vec3 x;
        Quat q;
        Mat3 R;
        Vec3 w_end;  // after the drift
    };
    JointPlans plans;
    JointRowList rows;
    BlockLdlt ldlt;
    std::vector<BodyMotion> saved_motion;  // by body of the island
    std::vector<BodyVelocity> saved_velocity;
    std::vector<Start> start;
    std::vector<Real> stiffness;
    std::vector<Real> lambda, previous, slope, total, target, residual, scratch;  // size rows
    std::vector<Real> steps, images;                                              // Broyden's s and A s, size rows × iterations
    std::vector<Real> norms;
};

// Steps an island without contacts by dt. The pool's warm impulses are read and written as those of an SI substep of `warm_step`, totals
// are filled; rows need not be built. When it fails, bodies and joints are as before. Allocates nothing once it has seen the island's
// graph.
RattleReport solve_island_rattle(RattleWorkspace& workspace, SolverBodies& bodies, JointPool& joints, const SiIsland& island, Real dt,
                                 const RattleSettings& settings, IslandProbe* probe = nullptr);

}  // namespace cairn
