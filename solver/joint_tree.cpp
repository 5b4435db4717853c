#include "solver/joint_tree.hpp"

#include <algorithm>

namespace cairn {
namespace {

template <int K>
using Columns = Eigen::Map<Eigen::Matrix<Real, 6, K>, Eigen::Aligned16>;
template <int K>
using ConstColumns = Eigen::Map<const Eigen::Matrix<Real, 6, K>, Eigen::Aligned16>;

// Calls f with the number of free motions as a constant.
template <typename Function>
void with_dofs(int dofs, Function f) {
    switch (dofs) {
        case 0:
            return;
        case 1:
            return f(std::integral_constant<int, 1>());
        case 3:
            return f(std::integral_constant<int, 3>());
        case 5:
            return f(std::integral_constant<int, 5>());
        default:
            return f(std::integral_constant<int, 6>());
    }
}

// Inverse of a symmetric positive definite matrix.
Mat3 inverse_symmetric(const Mat3& m) {
    const Real c00 = m(1, 1) * m(2, 2) - m(1, 2) * m(1, 2), c01 = m(0, 2) * m(1, 2) - m(0, 1) * m(2, 2);
    const Real c02 = m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1), c11 = m(0, 0) * m(2, 2) - m(0, 2) * m(0, 2);
    const Real c12 = m(0, 1) * m(0, 2) - m(0, 0) * m(1, 2), c22 = m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1);
    const Real s = 1 / (m(0, 0) * c00 + m(0, 1) * c01 + m(0, 2) * c02);
    Mat3 r;
    r << s * c00, s * c01, s * c02, s * c01, s * c11, s * c12, s * c02, s * c12, s * c22;
    return r;
}

// A turn about an axis through p.
inline void set_turn(const Vec3& p, const Vec3& w, Real* column) {
    column[0] = p[1] * w[2] - p[2] * w[1];
    column[1] = p[2] * w[0] - p[0] * w[2];
    column[2] = p[0] * w[1] - p[1] * w[0];
    for (int i = 0; i < 3; ++i) column[3 + i] = w[i];
}

inline void set_shift(const Vec3& v, Real* column) {
    for (int i = 0; i < 3; ++i) {
        column[i] = v[i];
        column[3 + i] = 0;
    }
}

// Turns about the three axes of the world through p.
inline void set_turns(const Vec3& p, Real* columns) {
    const Real turns[18] = {0, p[2], -p[1], 1, 0, 0, -p[2], 0, p[0], 0, 1, 0, p[1], -p[0], 0, 0, 0, 1};
    std::copy_n(turns, 18, columns);
}

inline void set_shifts(Real sign, Real* columns) {
    const Real shifts[18] = {sign, 0, 0, 0, 0, 0, 0, sign, 0, 0, 0, 0, 0, 0, sign, 0, 0, 0};
    std::copy_n(shifts, 18, columns);
}

// The angular motion at p that the row along `axis` sees with 1.
inline void set_dual(const Vec3& p, const Vec3& axis, Real sign, Real* column) {
    set_turn(p, axis * (sign / axis.squaredNorm()), column);
}

// Free motions in the first columns, those that the rows see in the others. `p`: the anchor of the body, or B's of a slider, from O.
template <JointKind K>
void place_joint(const JointGeometry& g, const BodyMotion& a, const BodyMotion& b, int side, const Vec3& origin, Real* S) {
    const Real sign = side == 0 ? 1 : -1;
    const bool is_a = side == 0 && K != JointKind::kSlider;
    const Vec3 p = is_a ? Vec3(a.x + a.R * g.anchor_a_A - origin) : Vec3(b.x + b.R * g.anchor_b_B - origin);
    if constexpr (K == JointKind::kBall) {
        set_turns(p, S);
        set_shifts(sign, S + 18);
    } else if constexpr (K == JointKind::kHinge) {
        const Vec3 axis_b = b.R * g.frame_B.col(0);
        set_turn(p, axis_b, S);
        set_shifts(sign, S + 6);
        for (int k = 0; k < 2; ++k) set_dual(p, (a.R * g.frame_A.col(1 + k)).cross(axis_b), sign, S + 24 + 6 * k);
    } else if constexpr (K == JointKind::kSlider || K == JointKind::kFixed) {
        const Mat3 E = a.R * g.frame_A, F = b.R * g.frame_B;
        if constexpr (K == JointKind::kFixed) set_shifts(sign, S);
        if constexpr (K == JointKind::kSlider)
            for (int k = 0; k < 3; ++k) set_shift((k == 0 ? 1 : sign) * E.col(k), S + 6 * k);
        for (int k = 0; k < 3; ++k) {
            const int* pair = joint_geometry::kAngularPair[k];
            set_dual(p, E.col(pair[0]).cross(F.col(pair[1])), sign, S + 18 + 6 * k);
        }
    } else {
        const Vec3 d = joint_geometry::separation(g, {a.x, a.R}, {b.x, b.R});
        const Vec3 u = direction_or(d, Vec3::UnitZ()), across = any_perpendicular(u);
        set_turns(p, S);
        set_shift(across, S + 18);
        set_shift(u.cross(across), S + 24);
        set_shift(sign * u, S + 30);
    }
}

void set_inertia(const BodyMotion& m, JointTree::Node& n) {
    n.mass = 1 / m.inv_mass;
    n.inertia = inverse_symmetric(m.inv_inertia_W);
    const Vec3& c = n.arm;
    const Vec3 mc = n.mass * c;
    // m on the diagonal, m c × beside it, and m (‖c‖² − c cᵀ) about O.
    const Real linear[18] = {n.mass, 0, 0, 0, mc[2], -mc[1], 0, n.mass, 0, -mc[2], 0, mc[0], 0, 0, n.mass, mc[1], -mc[0], 0};
    std::copy_n(linear, 18, n.I.data());
    Real* angular = n.I.data() + 18;
    const Real m2 = mc.dot(c);
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) {
            angular[6 * k + i] = n.I(3 + k, i);
            angular[6 * k + 3 + i] = n.inertia(i, k) - mc[i] * c[k];
        }
        angular[6 * k + 3 + k] += m2;
    }
}

// S̃ = L⁻ᵀ of a body that moves freely, column by column.
void invert_root(JointTree::Node& n) {
    Mat6 L = n.I;  // below the diagonal; inverses on it
    for (int j = 0; j < 6; ++j) {
        for (int i = 0; i < j; ++i) {
            Real s = L(j, i);
            for (int k = 0; k < i; ++k) s -= L(j, k) * L(i, k);
            L(j, i) = s * L(i, i);
        }
        Real s = L(j, j);
        for (int k = 0; k < j; ++k) s -= L(j, k) * L(j, k);
        L(j, j) = 1 / std::sqrt(s);
        for (int i = 0; i < j; ++i) {
            Real t = L(j, i) * n.S(i, i);
            for (int k = i + 1; k < j; ++k) t += L(j, k) * n.S(i, k);
            n.S(i, j) = -L(j, j) * t;
            n.S(j, i) = 0;
        }
        n.S(j, j) = L(j, j);
    }
}

// S̃ and Ũ from S, and what is left of the inertia for the parent, if any.
template <int K>
void eliminate(JointTree::Node& n, JointTree::Node* parent) {
    Columns<K> S(n.S.data()), U(n.U.data());
    U = n.I.lazyProduct(S);
    Eigen::Matrix<Real, K, K> D = S.transpose().lazyProduct(U);
    for (int j = 0; j < K; ++j) {
        for (int i = 0; i < j; ++i) {
            // D's row j becomes L's.
            Real s = D(j, i);
            for (int k = 0; k < i; ++k) s -= D(j, k) * D(i, k);
            D(j, i) = s * D(i, i);
        }
        Real s = D(j, j);
        for (int k = 0; k < j; ++k) s -= D(j, k) * D(j, k);
        const Real inverse = D(j, j) = 1 / std::sqrt(s);
        for (int i = 0; i < j; ++i) {
            S.col(j) -= D(j, i) * S.col(i);
            U.col(j) -= D(j, i) * U.col(i);
        }
        S.col(j) *= inverse;
        U.col(j) *= inverse;
    }
    if (!parent) return;
    for (int c = 0; c < 6; ++c) {
        Vec6 column = n.I.col(c);
        for (int k = 0; k < K; ++k) column -= U(c, k) * U.col(k);
        parent->I.col(c) += column;
    }
}

}  // namespace

void JointTree::gather(const TreePlan& plan, const JointRowList& rows, int body_begin, int dynamic_end) {
    const int bodies = dynamic_end - body_begin;
    body_begin_ = body_begin;
    nodes_.resize(bodies);
    node_of_.assign(bodies, -1);
    node_of_joint_.assign(rows.list().size(), -1);
    dofs_ = 0;
    int count = 0;
    const auto add = [&](int body, int parent) -> Node& {
        Node& n = nodes_[count];
        n.body = body + body_begin;
        n.parent = parent;
        n.root = parent < 0 ? count : nodes_[parent].root;
        n.joint = -1;
        n.base = kImmovable;
        n.dofs = 6;
        n.z = dofs_;
        node_of_[body] = count++;
        return n;
    };
    for (const TreePlan::Node& planned : plan.nodes) {
        Node& n = add(planned.body, planned.parent);
        n.joint = planned.joint;
        n.side = planned.side;
        if (n.joint >= 0) {
            const JointRow& row = rows.list()[n.joint];
            node_of_joint_[n.joint] = node_of_[planned.body];
            n.dofs = 6 - row.n;
            n.row = row.first;
            n.base = row.body[1 - n.side];
        }
        dofs_ += (n.dofs + 1) / 2 * 2;
    }
    for (int i = 0; i < bodies; ++i) {
        if (node_of_[i] >= 0) continue;
        add(i, -1);
        dofs_ += 6;
    }
    z_.assign(dofs_, 0);
}

void JointTree::build(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies) {
    for (Node& n : nodes_) {
        const BodyMotion& m = bodies.motion[n.body];
        n.arm = m.x - bodies.motion[nodes_[n.root].body].x;
        set_inertia(m, n);
    }
    for_each_listed_joint(pool, ranges, [&](auto kind, const auto& j, int i) {
        Node& n = nodes_[node_of_joint_[i]];
        place_joint<decltype(kind)::value>(j.geometry, bodies.motion[j.a], bodies.motion[j.b], n.side, bodies.motion[nodes_[n.root].body].x,
                                           n.S.data());
    });
    for (std::size_t i = nodes_.size(); i-- > 0;) {
        Node& n = nodes_[i];
        Node* parent = n.parent >= 0 ? &nodes_[n.parent] : nullptr;
        if (n.joint < 0) {
            invert_root(n);
            continue;
        }
        if (n.dofs == 0 && parent) parent->I += n.I;
        with_dofs(n.dofs, [&](auto k) { eliminate<decltype(k)::value>(n, parent); });
    }
}

Vec6 JointTree::momentum(const Node& n, const SolverBodies& bodies) const {
    const BodyVelocity& u = bodies.velocity[n.body];
    const Vec3 p = n.mass * u.v;
    Vec6 P;
    P << p, n.inertia * u.w + n.arm.cross(p);
    return P;
}

void JointTree::set_bias(const Real* r) {
    for (Node& n : nodes_) {
        if (n.joint < 0) {
            n.c.setZero();
            continue;
        }
        const int rows = 6 - n.dofs;
        const Real* T = n.S.data() + 6 * n.dofs;
        Vec6 c = r[n.row] * Eigen::Map<const Vec6, Eigen::Aligned16>(T);
        for (int k = 1; k < rows; ++k) c += r[n.row + k] * Eigen::Map<const Vec6, Eigen::Aligned16>(T + 6 * k);
        n.c = c;
    }
}

void JointTree::up(bool with_bias) {
    for (std::size_t i = nodes_.size(); i-- > 0;) {
        Node& n = nodes_[i];
        if (with_bias && n.joint >= 0) n.P -= n.I.lazyProduct(n.c);
        with_dofs(n.dofs, [&](auto k) {
            constexpr int K = decltype(k)::value;
            const Eigen::Matrix<Real, K, 1> z = ConstColumns<K>(n.S.data()).transpose().lazyProduct(n.P);
            std::copy_n(z.data(), K, &z_[n.z]);
            if (n.parent >= 0) n.P -= ConstColumns<K>(n.U.data()).lazyProduct(z);
        });
        if (n.parent >= 0) nodes_[n.parent].P += n.P;
    }
}

// From V of the bases (0 where there is none) and z_.
void JointTree::down(bool with_bias) {
    for (Node& n : nodes_) {
        const bool is_free = n.joint < 0;
        if (n.parent >= 0) n.V = nodes_[n.parent].V;
        const bool has_base = !is_free;
        Vec6 V = n.V;
        if (with_bias && has_base) V += n.c;
        with_dofs(n.dofs, [&](auto k) {
            constexpr int K = decltype(k)::value;
            Eigen::Matrix<Real, K, 1> q = Eigen::Map<const Eigen::Matrix<Real, K, 1>>(&z_[n.z]);
            if (has_base) q -= ConstColumns<K>(n.U.data()).transpose().lazyProduct(n.V);
            V += ConstColumns<K>(n.S.data()).lazyProduct(q);
        });
        n.V = V;
    }
}

void JointTree::project(const Real* r, SolverBodies& bodies) {
    if (r) set_bias(r);
    for (Node& n : nodes_) {
        n.P0 = n.P = momentum(n, bodies);
        n.V.setZero();
        if (n.parent >= 0 || n.joint < 0) continue;
        const BodyVelocity& u = bodies.velocity[n.base];
        const Vec3 arm = bodies.motion[n.base].x - (bodies.motion[n.body].x - n.arm);
        n.V << u.v + arm.cross(u.w), u.w;
    }
    up(r != nullptr);
    down(r != nullptr);
    for (const Node& n : nodes_) {
        BodyVelocity& u = bodies.velocity[n.body];
        u.w = n.V.tail<3>();
        u.v = n.V.head<3>() + u.w.cross(n.arm);
    }
}

void JointTree::correct(const Real* r, SolverBodies& bodies) {
    set_bias(r);
    for (Node& n : nodes_) {
        n.P.setZero();
        n.V.setZero();
    }
    up(true);
    down(true);
    add_velocities(bodies);
}

void JointTree::add_motion(const Real* dz, SolverBodies& bodies) {
    std::copy_n(dz, dofs_, z_.begin());
    for (Node& n : nodes_) n.V.setZero();
    down(false);
    add_velocities(bodies);
}

void JointTree::add_velocities(SolverBodies& bodies) const {
    for (const Node& n : nodes_) {
        BodyVelocity& u = bodies.velocity[n.body];
        const Vec3 w = n.V.tail<3>();
        u.w += w;
        u.v += n.V.head<3>() + w.cross(n.arm);
    }
}

void JointTree::note_impulse(int node, const Vec3& force, const Vec3& moment) {
    Node& n = nodes_[node];
    n.P0.head<3>() += force;
    n.P0.tail<3>() += moment + n.arm.cross(force);
}

void JointTree::joint_impulses(const SolverBodies& bodies, Real* lambda) {
    for (Node& n : nodes_) n.P = momentum(n, bodies) - n.P0;
    for (std::size_t i = nodes_.size(); i-- > 0;) {
        const Node& n = nodes_[i];
        if (n.joint < 0) continue;
        for (int k = n.dofs; k < 6; ++k) lambda[n.row + k - n.dofs] = n.S.col(k).dot(n.P);
        if (n.parent >= 0) nodes_[n.parent].P += n.P;
    }
}

}  // namespace cairn
