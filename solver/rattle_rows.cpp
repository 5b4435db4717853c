#include "solver/rattle_rows.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// A plan is never worth more edges than this a joint: a body with hundreds of joints makes all of them neighbours.
constexpr int kMaxEdgesPerJoint = 50;
constexpr std::size_t kMaxPlans = 4096;

std::uint64_t hash_of(const std::vector<int>& signature) {
    std::uint64_t h = 1469598103934665603ull;  // FNV-1a, a word at a time
    for (int s : signature) h = (h ^ static_cast<std::uint32_t>(s)) * 1099511628211ull;
    return h;
}

// One end of a joint.
struct End {
    int joint = 0;
    int side = 0;
};

JointPlan::Term make_term(const BlockPattern& pattern, const End& p, const End& q) {
    const BlockPlace place = pattern.off_diagonal(p.joint, q.joint);
    const End &row = place.swapped ? q : p, &column = place.swapped ? p : q;
    return {row.joint, row.side, column.joint, column.side, place.offset};
}

void make_plan(JointPlan& plan, Real max_flops) {
    const int count = static_cast<int>(plan.signature.size()) / 3;
    std::vector<int> sizes(count);
    std::vector<std::vector<End>> ends;
    for (int i = 0; i < count; ++i) {
        sizes[i] = joint_rows(static_cast<JointKind>(plan.signature[3 * i]));
        for (int side = 0; side < 2; ++side) {
            const int body = plan.signature[3 * i + 1 + side];
            if (body < 0) continue;
            if (body >= static_cast<int>(ends.size())) ends.resize(body + 1);
            ends[body].push_back({i, side});
        }
    }
    std::size_t edge_count = 0;
    for (const std::vector<End>& e : ends) edge_count += e.size() * (e.size() - 1) / 2;
    plan.is_too_costly = edge_count > static_cast<std::size_t>(kMaxEdgesPerJoint) * count;
    if (plan.is_too_costly) return;
    std::vector<std::pair<int, int>> edges;
    for (const std::vector<End>& e : ends)
        for (std::size_t p = 0; p < e.size(); ++p)
            for (std::size_t q = 0; q < p; ++q) edges.push_back({e[p].joint, e[q].joint});
    plan.pattern.analyse(sizes, edges);
    plan.is_too_costly = plan.pattern.factor_flops() > max_flops;
    if (plan.is_too_costly) return;
    for (const std::vector<End>& e : ends)
        for (std::size_t p = 0; p < e.size(); ++p)
            for (std::size_t q = 0; q < p; ++q) plan.terms.push_back(make_term(plan.pattern, e[p], e[q]));
    plan.tree = plan_tree(plan.signature);
}

Real dot6(const Real* a, const Real* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5];
}

JointPose pose_of(const BodyMotion& m) {
    return {m.x, m.R};
}

template <int N>
void take_side(const Jacobian<N>& G, const BodyMotion& body, Real* G_rows, Real* W_rows) {
    Eigen::Map<Eigen::Matrix<Real, 6, N>> Gt(G_rows), W(W_rows);
    Gt = G.transpose();
    W.template topRows<3>() = body.inv_mass * Gt.template topRows<3>();
    W.template bottomRows<3>() = body.inv_inertia_W.lazyProduct(Gt.template bottomRows<3>());
}

}  // namespace

const JointPlan& JointPlans::find(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, int body_begin,
                                  Real max_flops) {
    signature_.clear();
    for_each_listed_joint(pool, ranges, [&](auto kind, const auto& j, int) {
        const auto local = [&](int body) { return bodies.motion[body].inv_mass > 0 ? body - body_begin : -1; };
        signature_.push_back(static_cast<int>(kind()));
        signature_.push_back(local(j.a));
        signature_.push_back(local(j.b));
    });
    if (plans_.size() > kMaxPlans) plans_.clear();
    std::unique_ptr<JointPlan>& plan = plans_[hash_of(signature_)];
    if (!plan || plan->signature != signature_) {
        plan = std::make_unique<JointPlan>();
        plan->signature = signature_;
        make_plan(*plan, max_flops);
    }
    return *plan;
}

void JointRowList::gather(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, const JointPlan& plan) {
    list_.resize(ranges.count());
    rows_ = plan.pattern.rows();
    for_each_listed_joint(pool, ranges, [&](auto kind, const auto& j, int i) {
        JointRow& row = list_[i];
        row.n = joint_rows(decltype(kind)::value);
        row.first = plan.pattern.first_row(i);
        row.body[0] = j.a;
        row.body[1] = j.b;
        for (int side = 0; side < 2; ++side) {
            row.moves[side] = bodies.motion[row.body[side]].inv_mass > 0;
            row.counts[side] = row.body[side] != kImmovable;
        }
    });
}

void JointRowList::build(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies) {
    for_each_listed_joint(pool, ranges, [&](auto kind, const auto& j, int i) {
        constexpr JointKind K = decltype(kind)::value;
        constexpr int N = joint_rows(K);
        const BodyMotion &a = bodies.motion[j.a], &b = bodies.motion[j.b];
        Jacobian<N> G_a, G_b;
        joint_jacobian<K>(j.geometry, pose_of(a), pose_of(b), G_a, G_b);
        JointRow& row = list_[i];
        if (row.counts[0]) take_side<N>(G_a, a, row.G[0], row.W[0]);
        if (row.counts[1]) take_side<N>(G_b, b, row.G[1], row.W[1]);
    });
}

void JointRowList::assemble(const JointPlan& plan, BlockLdlt& ldlt) const {
    ldlt.begin(plan.pattern);
    for (std::size_t i = 0; i < list_.size(); ++i) {
        const JointRow& row = list_[i];
        Real* block = ldlt.values(plan.pattern.diagonal(static_cast<int>(i)));
        for (int side = 0; side < 2; ++side) {
            if (!row.moves[side]) continue;
            for (int r = 0; r < row.n; ++r)
                for (int c = 0; c <= r; ++c) block[r * row.n + c] += dot6(row.G[side] + 6 * r, row.W[side] + 6 * c);
        }
        for (int r = 0; r < row.n; ++r)
            for (int c = 0; c < r; ++c) block[c * row.n + r] = block[r * row.n + c];
    }
    for (const JointPlan::Term& t : plan.terms) {
        const JointRow &p = list_[t.i], &q = list_[t.j];
        Real* block = ldlt.values(t.offset);
        for (int r = 0; r < p.n; ++r)
            for (int c = 0; c < q.n; ++c) block[r * q.n + c] += dot6(p.G[t.side_i] + 6 * r, q.W[t.side_j] + 6 * c);
    }
}

void JointRowList::errors(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies, Real* c) const {
    for_each_listed_joint(pool, ranges, [&](auto kind, const auto& j, int i) {
        constexpr JointKind K = decltype(kind)::value;
        Eigen::Map<VecN<joint_rows(K)>>(c + list_[i].first) =
            joint_error<K>(j.geometry, pose_of(bodies.motion[j.a]), pose_of(bodies.motion[j.b]));
    });
}

void JointRowList::velocities(const std::vector<BodyVelocity>& velocities, Real* r) const {
    for (const JointRow& row : list_) {
        Real* out = r + row.first;
        std::fill_n(out, row.n, 0.0);
        for (int side = 0; side < 2; ++side) {
            if (!row.counts[side]) continue;
            const BodyVelocity& u = velocities[row.body[side]];
            const Real v[6] = {u.v[0], u.v[1], u.v[2], u.w[0], u.w[1], u.w[2]};
            for (int k = 0; k < row.n; ++k) out[k] += dot6(row.G[side] + 6 * k, v);
        }
    }
}

void JointRowList::apply(const Real* lambda, SolverBodies& bodies) const {
    for (const JointRow& row : list_) {
        const Real* l = lambda + row.first;
        for (int side = 0; side < 2; ++side) {
            if (!row.moves[side]) continue;
            Real change[6] = {0, 0, 0, 0, 0, 0};
            for (int k = 0; k < row.n; ++k)
                for (int c = 0; c < 6; ++c) change[c] += l[k] * row.W[side][6 * k + c];
            BodyVelocity& u = bodies.velocity[row.body[side]];
            u.v += Vec3(change[0], change[1], change[2]);
            u.w += Vec3(change[3], change[4], change[5]);
        }
    }
}

Real largest_arm(const JointPool& pool, const JointRanges& ranges, const SolverBodies& bodies) {
    Real square = 0;
    for_each_listed_joint(pool, ranges, [&](auto, const auto& j, int) {
        const JointGeometry& g = j.geometry;
        if (bodies.motion[j.a].inv_mass > 0) square = std::max(square, g.anchor_a_A.squaredNorm());
        if (bodies.motion[j.b].inv_mass > 0) square = std::max(square, g.anchor_b_B.squaredNorm());
        square = std::max(square, g.length * g.length);
    });
    return square > 0 ? std::sqrt(square) : 1;
}

}  // namespace cairn
