#include "solver/joint_rows.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Calls f(kind constant, pool of that kind, begin, end) for every type that the ranges hold: the one dispatch per pool and pass.
template <typename Function>
void for_each_type(JointPool& pool, const JointRanges& r, Function f) {
    const auto visit = [&](auto kind, auto& blocks) {
        const int k = static_cast<int>(kind());
        if (r.begin[k] < r.end[k]) f(kind, blocks, r.begin[k], r.end[k]);
    };
    visit(std::integral_constant<JointKind, JointKind::kBall>(), pool.ball);
    visit(std::integral_constant<JointKind, JointKind::kHinge>(), pool.hinge);
    visit(std::integral_constant<JointKind, JointKind::kSlider>(), pool.slider);
    visit(std::integral_constant<JointKind, JointKind::kFixed>(), pool.fixed);
    visit(std::integral_constant<JointKind, JointKind::kDistance>(), pool.distance);
}

JointPose pose_of(const BodyMotion& m) {
    return {m.x, m.R};
}

template <int N>
void mass_columns(const Jacobian<N>& G, const BodyMotion& body, Eigen::Matrix<Real, 6, N>& W) {
    W.template topRows<3>() = body.inv_mass * G.template leftCols<3>().transpose();
    W.template bottomRows<3>().noalias() = body.inv_inertia_W * G.template rightCols<3>().transpose();
}

// Inverse of a symmetric positive definite matrix by Gauss-Jordan elimination without pivoting, in place: for 5 and 6 rows Eigen would call
// its routines for matrices of any size.
template <int N>
Eigen::Matrix<Real, N, N> inverse_spd(Eigen::Matrix<Real, N, N> m) {
    for (int k = 0; k < N; ++k) {
        const Real pivot = 1 / m(k, k);
        m(k, k) = 1;
        for (int c = 0; c < N; ++c) m(k, c) *= pivot;
        for (int r = 0; r < N; ++r) {
            if (r == k) continue;
            const Real f = m(r, k);
            m(r, k) = 0;
            for (int c = 0; c < N; ++c) m(r, c) -= f * m(k, c);
        }
    }
    return m;
}

template <int N>
VecN<N> row_velocity(const JointBlock<N>& j, const BodyVelocity& a, const BodyVelocity& b) {
    return j.G_a.template leftCols<3>() * a.v + j.G_a.template rightCols<3>() * a.w + j.G_b.template leftCols<3>() * b.v +
           j.G_b.template rightCols<3>() * b.w;
}

template <int N>
void apply_impulse(const JointBlock<N>& j, const VecN<N>& lambda, SolverBodies& bodies) {
    if (bodies.motion[j.a].inv_mass > 0) {
        BodyVelocity& a = bodies.velocity[j.a];
        a.v += j.W_a.template topRows<3>() * lambda;
        a.w += j.W_a.template bottomRows<3>() * lambda;
    }
    if (bodies.motion[j.b].inv_mass > 0) {
        BodyVelocity& b = bodies.velocity[j.b];
        b.v += j.W_b.template topRows<3>() * lambda;
        b.w += j.W_b.template bottomRows<3>() * lambda;
    }
}

// Adds the impulses that `take` says.
template <typename Take>
void warm_start(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies, Take take) {
    for_each_type(pool, ranges, [&](auto kind, auto& blocks, int begin, int end) {
        constexpr int N = joint_rows(decltype(kind)::value);
        for (int i = begin; i < end; ++i) {
            const VecN<N> lambda = take(blocks[i]);
            blocks[i].impulse += lambda;
            apply_impulse<N>(blocks[i], lambda, bodies);
        }
    });
}

// One sweep towards G v = −bias_of(joint). Returns the largest velocity error met.
template <typename BiasOf>
Real sweep(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies, const Softness& soft, BiasOf bias_of) {
    Real change = 0;
    for_each_type(pool, ranges, [&](auto kind, auto& blocks, int begin, int end) {
        constexpr int N = joint_rows(decltype(kind)::value);
        for (int i = begin; i < end; ++i) {
            JointBlock<N>& j = blocks[i];
            const VecN<N> error = row_velocity<N>(j, bodies.velocity[j.a], bodies.velocity[j.b]) + bias_of(j);
            const VecN<N> lambda = -soft.mass_scale * (j.inv_S * error) - soft.impulse_scale * j.impulse;
            change = std::max(change, error.cwiseAbs().maxCoeff());
            j.impulse += lambda;
            apply_impulse<N>(j, lambda, bodies);
        }
    });
    return change;
}

template <typename Function>
void for_each_joint(JointPool& pool, const JointRanges& ranges, Function f) {
    for_each_type(pool, ranges, [&](auto, auto& blocks, int begin, int end) {
        for (int i = begin; i < end; ++i) f(blocks[i]);
    });
}

// Where a body's present velocity leads within h.
JointPose predicted_pose(const BodyMotion& m, const BodyVelocity& u, Real h) {
    return {m.x + h * u.v, exp_rotation(h * u.w).toRotationMatrix() * m.R};
}

}  // namespace

void JointPool::clear() {
    ball.clear();
    hinge.clear();
    slider.clear();
    fixed.clear();
    distance.clear();
}

bool JointRanges::empty() const {
    for (int k = 0; k < 5; ++k)
        if (begin[k] < end[k]) return false;
    return true;
}

int JointRanges::count() const {
    int n = 0;
    for (int k = 0; k < 5; ++k) n += end[k] - begin[k];
    return n;
}

int JointRanges::rows() const {
    int n = 0;
    for (int k = 0; k < 5; ++k) n += (end[k] - begin[k]) * joint_rows(static_cast<JointKind>(k));
    return n;
}

void build_joints(JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies) {
    for_each_type(pool, ranges, [&](auto kind, auto& blocks, int begin, int end) {
        constexpr JointKind K = decltype(kind)::value;
        constexpr int N = joint_rows(K);
        for (int i = begin; i < end; ++i) {
            JointBlock<N>& j = blocks[i];
            const BodyMotion &a = bodies.motion[j.a], &b = bodies.motion[j.b];
            joint_jacobian<K>(j.geometry, pose_of(a), pose_of(b), j.G_a, j.G_b);
            mass_columns<N>(j.G_a, a, j.W_a);
            mass_columns<N>(j.G_b, b, j.W_b);
            const Eigen::Matrix<Real, N, N> S = j.G_a.lazyProduct(j.W_a) + j.G_b.lazyProduct(j.W_b);
            if constexpr (N <= 3) {
                j.inv_S = S.inverse();
            } else {
                j.inv_S = inverse_spd<N>(S);
            }
        }
    });
}

void bias_joints(JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, Real h, Real rate) {
    for_each_type(pool, ranges, [&](auto kind, auto& blocks, int begin, int end) {
        constexpr JointKind K = decltype(kind)::value;
        constexpr int N = joint_rows(K);
        for (int i = begin; i < end; ++i) {
            JointBlock<N>& j = blocks[i];
            const BodyVelocity &ua = bodies.velocity[j.a], &ub = bodies.velocity[j.b];
            const JointPose a = predicted_pose(bodies.motion[j.a], ua, h), b = predicted_pose(bodies.motion[j.b], ub, h);
            j.bias = rate / h * joint_error<K>(j.geometry, a, b) - rate * row_velocity<N>(j, ua, ub);
        }
    });
}

void bias_joints_baumgarte(JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, Real h, Real beta) {
    for_each_type(pool, ranges, [&](auto kind, auto& blocks, int begin, int end) {
        constexpr JointKind K = decltype(kind)::value;
        for (int i = begin; i < end; ++i) {
            auto& j = blocks[i];
            j.bias = beta / h * joint_error<K>(j.geometry, pose_of(bodies.motion[j.a]), pose_of(bodies.motion[j.b]));
        }
    });
}

void scale_warm_start(JointPool& pool, const JointRanges& ranges, Real scale) {
    for_each_joint(pool, ranges, [&](auto& j) {
        j.warm_first *= scale;
        j.warm_second *= scale;
    });
}

void warm_start_first(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies) {
    warm_start(pool, ranges, bodies, [](const auto& j) { return j.warm_first; });
}

void warm_start_second(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies) {
    warm_start(pool, ranges, bodies, [](const auto& j) { return j.warm_second; });
}

void warm_start_all(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies) {
    warm_start(pool, ranges, bodies, [](const auto& j) { return (j.warm_first + j.warm_second).eval(); });
}

Real sweep_joint_positions(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies, const Softness& soft) {
    return sweep(
        pool, ranges, bodies, soft, [](const auto& j) -> const auto& { return j.bias; });
}

void hold_joints(JointPool& pool, const JointRanges& ranges) {
    for_each_joint(pool, ranges, [](auto& j) { j.held_impulse = j.impulse; });
}

Real sweep_joint_velocities(JointPool& pool, const JointRanges& ranges, SolverBodies& bodies) {
    return sweep(pool, ranges, bodies, {}, [](const auto& j) { return std::decay_t<decltype(j.bias)>::Zero(); });
}

void close_joint_substep(JointPool& pool, const JointRanges& ranges) {
    for_each_joint(pool, ranges, [](auto& j) {
        j.total += j.impulse;
        j.warm_first = j.held_impulse;
        j.warm_second = j.impulse - j.held_impulse;
        j.impulse.setZero();
    });
}

}  // namespace cairn
