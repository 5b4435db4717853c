// Contact rows of bodies that joints hold in trees, in the coordinates z of solver/joint_tree.hpp.
//
// A row with the Jacobian J is ỹ in them, which vanishes outside the ways of its two bodies to their roots, so projected Gauss-Seidel
// over the contacts alone,
//     λ ← max(λ − (ỹᵀ z − target) / ‖ỹ‖², 0),  z ← z + ỹ Δλ,
// meets contacts and joints together at the price of two short dot products a row. z counts from where the sweeps begin; what a row's
// velocity was there is kept beside it. Friction likewise. Internal to solver/mixed.
#pragma once

#include "solver/contact_rows.hpp"
#include "solver/joint_tree.hpp"
#include "solver/tree_data.hpp"
#include "solver/wide_data.hpp"

namespace cairn {

const TreeKernel* best_tree_kernel();

class TreeContacts {
public:
    explicit TreeContacts(const TreeKernel* kernel = best_tree_kernel()) : kernel_(kernel) {}

    // Takes the ways of the contacts' bodies. False: they are too long, the rows would not pay. Allocates as JointTree::gather.
    bool gather(const JointTree& tree, const ContactPool& contacts, BlockRange range, int body_begin, int dynamic_end);
    // ỹ at the present poses of the tree that has been gathered, and the Jacobians of the pool.
    void build(const ContactPool& contacts, BlockRange range);

    // Begins sweeps as those of solver/contact_rows.hpp over gaps or over velocities and friction, at the present velocities; they must be
    // such that the joints hold.
    void begin_gaps(const ContactPool& contacts, BlockRange range, const SolverBodies& bodies, Real h, Real push_rate);
    void begin_velocities(const ContactPool& contacts, BlockRange range, const SolverBodies& bodies);
    // One sweep. Returns a bound of the largest velocity change of a row [m/s].
    Real sweep(ContactPool& contacts, bool with_friction);
    // What z has changed by since begin().
    const Real* motion() const { return z_.data(); }

    // Tells the tree what impulses the sweeps have given.
    void note_impulses(const ContactPool& contacts, BlockRange range, bool with_friction, JointTree& tree) const;

private:
    void begin(const ContactPool& contacts, BlockRange range);
    void add_way(const JointTree& tree, int a, int b, TreeBlock& block);

    const TreeKernel* kernel_;
    int count_ = 0;  // of blocks; vectors keep their size
    std::vector<TreePart> parts_;
    std::vector<TreeBlock> blocks_;  // of the range
    std::vector<int> nodes_;         // two a block: of its bodies, −1: does not move, or moves as it will
    std::vector<int> pairs_;
    std::vector<TreeRow> rows_;
    std::vector<Real> values_;
    std::vector<PointImpulse> start_;  // by point: where the sweeps began
    std::vector<Real> z_;              // and two that stand for nothing
    std::vector<Wide> scratch_;
};

}  // namespace cairn
