// Joint rows, one pool per joint type; a joint's rows are solved as one block.
//
// With p_a, p_b the joint's anchors on A and B, d = p_a − p_b, frames of unit columns e_k (on A) and f_k (on B) that agree at rest:
//     ball      C = d                                            3 rows
//     hinge     C = (d, e_1·f_0, e_2·f_0), axis e_0 = f_0         5
//     slider    C = (e_1·d, e_2·d, ang), axis e_0                5
//     fixed     C = (d, ang)                                      6
//     distance  C = ‖d‖ − L                                       1
// with ang = (e_1·f_2, e_2·f_0, e_0·f_1): zero when the frames agree, and d/dt (e·f) = (w_a − w_b)·(e × f).
// Ċ = G v with v = (v_a, w_a, v_b, w_b); impulses λ act as Gᵀ λ, so + on A. S = G M⁻¹ Gᵀ. All in World.
// Sources: Cline 2002 (rigid-body constraints), Catto 2009; the derivations are ours.
#pragma once

#include "solver/body.hpp"
#include "solver/joint_geometry.hpp"
#include "solver/softness.hpp"

#include <vector>

namespace cairn {

template <int N>
struct JointBlock {
    int a = kImmovable;
    int b = kImmovable;
    JointGeometry geometry;
    Jacobian<N> G_a, G_b;
    Eigen::Matrix<Real, 6, N> W_a, W_b;  // M⁻¹ Gᵀ
    Eigen::Matrix<Real, N, N> inv_S;     // (G M⁻¹ Gᵀ)⁻¹
    VecN<N> bias;                        // target of the first solve: G v = −bias
    VecN<N> warm_first;                  // impulses that the two solves of a substep start from [N s, N m s]: where they ended
    VecN<N> warm_second;                 // (what the second solve added)
    VecN<N> held_impulse;                // at the end of the first solve
    VecN<N> impulse;                     // unknowns of the running substep
    VecN<N> total;                       // summed over the substeps
};

// Pools of all islands, a range per island and type.
struct JointPool {
    std::vector<JointBlock<3>> ball;
    std::vector<JointBlock<5>> hinge;
    std::vector<JointBlock<5>> slider;
    std::vector<JointBlock<6>> fixed;
    std::vector<JointBlock<1>> distance;
    void clear();
};

struct JointRanges {
    int begin[5] = {0, 0, 0, 0, 0};
    int end[5] = {0, 0, 0, 0, 0};
    bool empty() const;
    int count() const;  // of joints
    int rows() const;
};

// Rebuilds G, M⁻¹Gᵀ and S⁻¹ at the current poses.
void build_joints(JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies);

// Sets the bias of the first solve so that it moves C to (1 − rate) times what the present velocities would make of it within h: C is
// evaluated at the pose that they lead to (the first step of SHAKE's iteration, Ryckaert et al. 1977), so it is the joint that is met at
// the end of the drift, not its linearisation.
void bias_joints(JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, Real h, Real rate);

// Bias of the textbook method: beta C / h at the present pose.
void bias_joints_baumgarte(JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, Real h, Real beta);

// Multiplies the warm impulses, when the length of the step has changed.
void scale_warm_start(JointPool& pool, const JointRanges& ranges, Real scale);

// Starts the first solve, the second, or the textbook's one solve from the warm impulses.
void warm_start_first(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies);
void warm_start_second(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies);
void warm_start_all(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies);

// One Gauss-Seidel sweep towards G v = −bias, as soft as `soft` says (first solve). Returns the largest velocity error that it met.
Real sweep_joint_positions(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies, const Softness& soft);

// Notes where the first solve ended.
void hold_joints(JointPool& pool, const JointRanges& ranges);

// One Gauss-Seidel sweep towards G v = 0 (second solve).
Real sweep_joint_velocities(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies);

// At the end of a substep: total += impulse, the warm impulses follow, impulse = 0.
void close_joint_substep(JointPool& pool, const JointRanges& ranges);

}  // namespace cairn
