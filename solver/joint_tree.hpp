// Bodies that joints join to trees, in the coordinates that the joints leave free.
//
// A body j hangs from its parent p by one joint. With velocities as twists V = (v_O, w) about one point O of the tree (v_O: of the material
// at O), what the joint admits is
//     V_j = V_p + c_j + S_j q̇_j        S_j: the joint's free motions, 6 columns less its rows; c_j: what its rows are to be, where not 0
// and G V = r holds whatever the q̇ are. The velocities nearest to given momenta P_i = I_i V_i in the metric of the masses,
//     min ½ Σ V_iᵀ I_i V_i − P_iᵀ V_i,
// follow from the leaves to the root and back (the articulated-body inertias of Featherstone 1983; Baraff 1996 meets the same problem with
// impulses instead). Leaving q̇_j out of a tree whose leaf is j, with D = S_jᵀ I^A_j S_j = L Lᵀ, S̃ = S L⁻ᵀ, Ũ = I^A S̃:
//     up    P' = P_j − I^A_j c_j,  z_j = S̃ᵀ P',  P_p += P' − Ũ z_j,  I^A_p += I^A_j − Ũ Ũᵀ
//     down  V_j = V_p + c_j + S̃ (z_j − Ũᵀ V_p)
// In these z the kinetic energy is ½ Σ z²: an impulse f on body j (force and moment about O) changes z on the way from j to the root alone,
//     ỹ_j = S̃_jᵀ f,  f ← f − Ũ_j ỹ_j,  on to the parent,
// which is all that contact rows need (solver/tree_contacts.hpp). D is never singular: every joint of a tree is independent of the others.
//
// The joints' own impulses are what the momenta below a joint have changed by that nothing else explains: λ_j = T_jᵀ f_j, where T_j (6 ×
// rows) are motions with G T = 1; c_j = T_j r as well. All in World; units and signs of rows as in solver/joint_rows.hpp. Internal to
// solver/mixed.
#pragma once

#include "solver/rattle_rows.hpp"

namespace cairn {

using Vec6 = Eigen::Matrix<Real, 6, 1>;
using Mat6 = Eigen::Matrix<Real, 6, 6>;

class JointTree {
public:
    struct Node {
        Mat6 I;  // I^A about O
        Mat6 S;  // S̃ in the first `dofs` columns, T in the others
        Mat6 U;  // Ũ in the first `dofs` columns
        Vec6 P, V, c, P0;
        Mat3 inertia;  // of the body itself, about its centre [kg m²]
        Vec3 arm;      // from O to the body's centre [m]
        Real mass = 0;
        int body = 0;
        int parent = -1;
        int root = 0;
        int joint = -1;         // in the list, −1: a root that moves freely
        int side = 0;           // of the joint that the body is
        int row = 0;            // first of the joint's
        int base = kImmovable;  // of a root with a joint: what it hangs from
        int dofs = 6;
        int z = 0;  // first of its z, even
    };

    // Takes an island's bodies and joints; those without joints are roots. Allocates when it sees more of them than before.
    void gather(const TreePlan& plan, const JointRowList& rows, int body_begin, int dynamic_end);
    // S̃, Ũ and T at the present poses.
    void build(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies);

    const std::vector<Node>& nodes() const { return nodes_; }
    int node_of(int body) const { return node_of_[body - body_begin_]; }
    int dofs() const { return dofs_; }  // numbers in z; a node with an odd number of them leaves one out

    // Velocities with G u = r that are nearest to the present ones, from whose momenta joint impulses are counted. r by row; null: 0.
    void project(const Real* r, SolverBodies& bodies);
    // Adds the smallest change of velocities that changes G u by r.
    void correct(const Real* r, SolverBodies& bodies);
    // Adds what a change of z makes of the velocities.
    void add_motion(const Real* dz, SolverBodies& bodies);

    // An impulse on a body that is not the joints' own: a force and its moment about the body's centre.
    void note_impulse(int node, const Vec3& force, const Vec3& moment);
    // λ since project(), by row.
    void joint_impulses(const SolverBodies& bodies, Real* lambda);

private:
    void set_bias(const Real* r);
    void up(bool with_bias);
    void down(bool with_bias);
    Vec6 momentum(const Node& n, const SolverBodies& bodies) const;
    void add_velocities(SolverBodies& bodies) const;

    std::vector<Node> nodes_;         // parents first
    std::vector<int> node_of_;        // by body of the island
    std::vector<int> node_of_joint_;  // by place in the list
    std::vector<Real> z_;
    int body_begin_ = 0;
    int dofs_ = 0;
};

}  // namespace cairn
