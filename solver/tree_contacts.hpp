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

namespace cairn {

class TreeContacts {
public:
    // Takes the ways of the contacts' bodies. False: they are too long, the rows would not pay. Allocates as JointTree::gather.
    bool gather(const JointTree& tree, const ContactPool& contacts, BlockRange range, int body_begin, int dynamic_end);
    // ỹ at the poses of the tree and the Jacobians of the pool.
    void build(const JointTree& tree, const ContactPool& contacts, BlockRange range);

    // Reads the velocities; they must be such that the joints hold.
    void begin(const ContactPool& contacts, BlockRange range, const SolverBodies& bodies, bool with_friction);
    // Sweeps as their namesakes in solver/contact_rows.hpp. Each returns a bound of the largest velocity change of a row [m/s].
    Real sweep_gaps(ContactPool& contacts, BlockRange range, Real h, Real push_rate);
    Real sweep_velocities(ContactPool& contacts, BlockRange range);
    // What z has changed by since begin().
    const Real* motion() const { return z_.data(); }

    // Tells the tree what impulses the contacts have given since the rows' held ones, or at all.
    void note_impulses(const ContactPool& contacts, BlockRange range, bool since_held, JointTree& tree) const;

private:
    // A part of a block's way: a node's z.
    struct Part {
        int node = 0;
        int z = 0;
        int dofs = 0;
        int at = 0;      // among the block's own
        int side = 0;    // whose impulse goes this way, of both from where they meet
        bool meets = false;
    };
    struct Way {
        int a = -1, b = -1;  // nodes; −1: does not move, or moves as it will
        int begin = 0, end = 0;  // in parts_
        int length = 0;          // of a row, a multiple of kPad
        int values = 0;          // first of the block's rows
        int row = 0;             // first of its rows
        int rows_a_point = 1;
    };
    struct Row {
        Real mass = 0;
        Real velocity = 0;  // at the beginning of the sweeps
    };

    template <int R>
    void build_point(const JointTree& tree, const Way& way, const ContactBlock& block, const PointRow* const* rows, int first_row);
    template <typename TargetOf>
    Real sweep(ContactPool& contacts, BlockRange range, bool with_friction, TargetOf target_of);

    std::vector<Part> parts_;
    std::vector<Way> ways_;  // by block of the range
    std::vector<Row> rows_;
    std::vector<Real> values_;
    std::vector<Real> z_, local_;
};

}  // namespace cairn
