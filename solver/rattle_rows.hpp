// Joint rows as the joint solve of an island wants them: all types in one list, their Jacobians in rows of six, and the pattern of
//
//     A = G M⁻¹ Gᵀ      a block per joint, and one for each two joints that share a dynamic body
//
// All in World; units and signs as in solver/joint_rows.hpp. Internal to the direct solves of joints.
#pragma once

#include "solver/block_ldlt.hpp"
#include "solver/joint_rows.hpp"
#include "solver/joint_tree_plan.hpp"

#include <memory>
#include <unordered_map>
#include <vector>

namespace cairn {

// What of the solve depends on the graph of joints alone.
struct JointPlan {
    // G of joint i's side times M⁻¹Gᵀ of joint j's side goes to the block at `offset`, whose rows are those of i.
    struct Term {
        int i = 0, side_i = 0;
        int j = 0, side_j = 0;
        int offset = 0;
    };
    std::vector<int> signature;  // of the joints in order: kind, bodies relative to the island's first (−1: does not move)
    BlockPattern pattern;
    std::vector<Term> terms;     // off-diagonal
    TreePlan tree;
    bool is_too_costly = false;  // then nothing else is filled
};

// Plans by graph, kept over the steps: equal islands share one. What is in it never shows in a result.
class JointPlans {
public:
    // The plan of an island's joints. Allocates when it is new. `max_flops`: of one factorisation.
    const JointPlan& find(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, int body_begin, Real max_flops);

private:
    std::unordered_map<std::uint64_t, std::unique_ptr<JointPlan>> plans_;
    std::vector<int> signature_;  // scratch
};

// G and M⁻¹Gᵀ of one joint, side 0 for A, side 1 for B: entries [6 r, 6 r + 6) belong to row r.
struct JointRow {
    int n = 0;      // rows
    int first = 0;  // where they are in the order of elimination
    int body[2] = {0, 0};
    bool moves[2] = {false, false};   // has an inverse mass
    bool counts[2] = {false, false};  // has a velocity: moves or is driven
    Real G[2][6 * kMaxBlockRows];
    Real W[2][6 * kMaxBlockRows];
};

class JointRowList {
public:
    // Takes the joints' bodies and places. Allocates when the list grows.
    void gather(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, const JointPlan& plan);
    // G and M⁻¹Gᵀ at the present poses.
    void build(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies);
    // A into the factor's blocks.
    void assemble(const JointPlan& plan, BlockLdlt& ldlt) const;
    // C at the present poses, size rows().
    void errors(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, Real* c) const;
    // G u, size rows().
    void velocities(const std::vector<BodyVelocity>& u, Real* r) const;
    void velocities(const SolverBodies& bodies, Real* r) const { velocities(bodies.velocity, r); }
    // u += M⁻¹ Gᵀ λ.
    void apply(const Real* lambda, SolverBodies& bodies) const;

    int rows() const { return rows_; }
    const std::vector<JointRow>& list() const { return list_; }

private:
    std::vector<JointRow> list_;
    int rows_ = 0;
};

// The farthest anchor from the centre of a body that moves, or the longest rod [m]: what tolerances of joints refer to. 1 if all are 0.
Real largest_arm(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies);

// Calls f(kind as a constant, block, index in the list) for the joints of the ranges in the list's order.
template <typename Pool, typename Function>
void for_each_listed_joint(Pool& pool, const JointRanges& ranges, Function f) {
    int index = 0;
    const auto visit = [&](auto kind, auto& blocks) {
        constexpr int k = static_cast<int>(decltype(kind)::value);
        for (int i = ranges.begin[k]; i < ranges.end[k]; ++i) f(kind, blocks[i], index++);
    };
    visit(std::integral_constant<JointKind, JointKind::kBall>(), pool.ball);
    visit(std::integral_constant<JointKind, JointKind::kHinge>(), pool.hinge);
    visit(std::integral_constant<JointKind, JointKind::kSlider>(), pool.slider);
    visit(std::integral_constant<JointKind, JointKind::kFixed>(), pool.fixed);
    visit(std::integral_constant<JointKind, JointKind::kDistance>(), pool.distance);
}

}  // namespace cairn
