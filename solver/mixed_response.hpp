// How bodies that joints hold answer to contacts: contact rows in the space where the joints hold.
//
// With the joints met by their own impulses, an impulse f (force and moment, 6 numbers) on body j changes the velocity of body i by W_ij f,
//     W = M⁻¹ − M⁻¹ Gᵀ A⁻¹ G M⁻¹,   A = G M⁻¹ Gᵀ = L D Lᵀ
// With Y_j = L⁻¹ G M⁻¹ E_j (E_j: the columns of body j) that is W_ij = δ_ij M_i⁻¹ − Y_iᵀ D⁻¹ Y_j, and Y_j vanishes outside the way of body
// j's joints to the root of the tree of eliminations: short where joints make a tree, and products of two bodies of different trees vanish.
// (Another form of the operational-space inertia of Khatib 1987, as Baraff 1996 uses it for contacts; the derivation is ours.)
//
// A contact row with the Jacobian J then has the effective mass 1 / (J W Jᵀ) and moves all touched bodies of its trees, so projected
// Gauss-Seidel over the contacts alone converges to the solution of contacts and joints together. Internal to solver/mixed.
#pragma once

#include "solver/contact_rows.hpp"
#include "solver/rattle_rows.hpp"

namespace cairn {

using Vec6 = Eigen::Matrix<Real, 6, 1>;
using Mat6 = Eigen::Matrix<Real, 6, 6>;

class ContactResponse {
public:
    // Takes the island's graph: which bodies contacts touch, and what joins them. False: too many that are joined, W would not pay.
    bool gather(const JointRowList& rows, const JointPlan& plan, const ContactPool& contacts, BlockRange range, const SolverBodies& bodies,
                int body_begin, int dynamic_end);
    // W at the poses of the factor.
    void build(const JointRowList& rows, const JointPlan& plan, const BlockLdlt& ldlt, const SolverBodies& bodies);
    // Contact rows at their present Jacobians.
    void build_rows(const ContactPool& contacts, BlockRange range);

    // Reads the velocities of the touched bodies; they must be such that the joints hold.
    void begin(const SolverBodies& bodies);
    // Sweeps as their namesakes in solver/contact_rows.hpp, on the velocities that begin() has read. Each returns a bound of the largest
    // velocity change of a row [m/s].
    Real sweep_gaps(ContactPool& contacts, BlockRange range, Real h, Real push_rate);
    Real sweep_velocities(ContactPool& contacts, BlockRange range);
    // Gives the bodies the contacts' impulses since begin(), each its own: the joints' are then to be solved for.
    void end(SolverBodies& bodies) const;

private:
    struct Row {
        Vec6 J_a, J_b;  // G of the row
        Vec6 Y_a, Y_b;  // W Gᵀ at its own two bodies
        Real mass = 0;
    };
    // A body that contacts touch.
    struct Touched {
        int body = 0;
        int tree = 0;   // turn at the root of its joints; −1 − body: it has no joints
        int group = 0;  // of the touched bodies of one tree
        int path_begin = 0, path_end = 0;
        int y = 0;  // first row of its Y
    };
    struct Group {
        int begin = 0, end = 0;  // in touched_
        int w = 0;               // first of its blocks of W, (end − begin)² in row-major order
    };
    struct Sides {
        int a = -1, b = -1;  // in touched_; −1: does not move, or moves as it will
    };

    template <typename TargetOf>
    Real sweep(ContactPool& contacts, BlockRange range, bool with_friction, TargetOf target_of);
    void gather_paths(const JointRowList& rows, const JointPlan& plan);
    void product(const Touched& i, const Touched& j, const BlockPattern& pattern, Mat6& out) const;
    Row make_row(const Sides& sides, const Vec3& direction, const PointRow& point) const;
    void spread(int touched, int other, const Vec6& f);
    const Mat6& w(int i, int j) const {
        const Group& g = groups_[touched_[i].group];
        return W_[g.w + (i - g.begin) * (g.end - g.begin) + (j - g.begin)];
    }

    std::vector<Touched> touched_;
    std::vector<Group> groups_;
    std::vector<int> touched_of_;       // by body of the island, −1: not touched
    std::vector<int> tree_of_;          // by body of the island
    std::vector<int> path_, path_row_;  // turns, and the row of Y that belongs to each
    std::vector<int> offset_;           // by turn, scratch
    std::vector<Real> Y_, Z_;           // six columns a row
    std::vector<Mat6> W_;
    std::vector<Sides> sides_;        // by block of the range
    std::vector<Vec6> fixed_;         // by block: velocity of the side that does not answer
    std::vector<Row> rows_;           // 3 a point: normal, friction
    std::vector<Vec6> velocity_, f_;  // by touched body
    int body_begin_ = 0;
};

}  // namespace cairn
