// Follows the solve of one island, where somebody asks for it: residuals of its rows, and the work of their impulses. Solvers tell it what
// they have done; it changes nothing.
//
// Work. A solve changes velocities by M (v⁺ − v⁻) = Gᵀ Δλ, and the kinetic energy by exactly
//     ½ v⁺ᵀ M v⁺ − ½ v⁻ᵀ M v⁻ = Δλᵀ G ½ (v⁻ + v⁺),
// a sum over rows. A substep kicks h/2 by the external acceleration a (with I⁻¹τ for its angular part), solves (Δλ₁), drifts with v₁, kicks
// h/2, solves (Δλ₂). Which of kick and solve comes first is ours to choose: both only add to v. Taken as solve, kick, drift, kick, solve,
// the kicks' work on a body is (v₁ − h a/4)·m a h/2 + (v₁ + h a/4)·m a h/2 = m a·(h v₁), the force times the way, and that of rows is
//     first solve   Δλ₁ᵀ G (½ (v₀ + v₁) − h/4 a)        second solve   Δλ₂ᵀ G (½ (v₁ + v₂) + h/4 a)
// with v₀, v₁, v₂ after the last substep, the first and the second solve. What a resting body's rows give in one they take in the other.
// The textbook's substep has one solve and its kick in one; there rows have ½ (v₀ + v₁), and what its kick misses of the way is left over.
// Where G v holds the velocity of a kinematic body, its part −Δλ G_k v_k is the work that it does.
//
// Stabilisation: a push moves a body by d beyond its velocity; forces do m a·d on the way, which no velocity shows, so the push is taken to
// have done −m a·d. In the textbook's solves, where a row aims at a bias b of stabilisation, ½ Δλ b of its work is that.
// Source: the derivation is ours. All in World. Allocates where an island is larger than any before it.
#pragma once

#include "solver/contact_models.hpp"
#include "solver/joint_rows.hpp"
#include "solver/measures.hpp"
#include "solver/rattle_rows.hpp"
#include "solver/si.hpp"

#include <vector>

namespace cairn {

enum class SolveTurn : std::uint8_t { kFirst, kSecond, kOnly };

class IslandProbe {
public:
    // Forgets what it knows.
    void begin(const SiIsland& island, FrictionModel friction);

    // Before the first kick of a substep of h.
    void begin_substep(const SolverBodies& bodies, Real h);
    // After a solve: the velocities are what it leaves, the pools hold the impulses of the substep so far, on the rows of the solve.
    void note_solve(SolveTurn turn, const SolverBodies& bodies, const ContactPool& contacts, const JointPool& joints,
                    const RowTargets* textbook = nullptr);
    // The same, where joint rows are a list; `joint_impulses`: of the substep so far, by row of the list.
    void note_solve(SolveTurn turn, const SolverBodies& bodies, const ContactPool& contacts, const JointRowList& rows,
                    const std::vector<Real>& joint_impulses);
    // After a drift: velocities may have turned. `pushed`: SolverBodies::push holds what moved the bodies on top of them.
    void note_drift(const SolverBodies& bodies, bool pushed);
    // Poses that were moved without velocities, from where they were to where they are.
    void note_moved(const BodyMotion& from, const BodyMotion& to);

    // Residuals of the solve that ends a substep; `x`: contact impulses of the substep. Joint rows must be built.
    void measure(const SolverBodies& bodies, const ContactPool& contacts, const std::vector<PointImpulse>& x, const JointPool& joints,
                 const RowTargets* textbook = nullptr);

    const ResidualMeasure& residual() const { return residual_; }
    const ImpulseWork& work() const { return work_; }

private:
    void take_means(SolveTurn turn, const SolverBodies& bodies);
    void note_contacts(const ContactPool& contacts, const RowTargets* textbook);
    void note_spins(const ContactPool& contacts);
    template <int N>
    void note_joint(const JointBlock<N>& j, bool biased, Real* noted);

    SiIsland island_;
    FrictionModel friction_ = FrictionModel::kPyramid;
    Real h_ = 0;
    std::vector<BodyVelocity> before_;           // size of the bodies: velocities when the solve began
    std::vector<BodyVelocity> mean_;             // likewise: what rows' impulses are to be multiplied with
    std::vector<BodyVelocity> driven_;           // of kinematic bodies; 0 of all others
    std::vector<PointImpulse> noted_;            // by point of the pool: impulses whose work is known
    std::vector<Vec3> noted_spins_;              // likewise, by spin row of the island
    std::vector<Real> noted_joints_;             // by row
    std::vector<Real> rows_mean_, rows_driven_;  // scratch, by row of a list
    ResidualMeasure residual_;
    ImpulseWork work_;
};

}  // namespace cairn
