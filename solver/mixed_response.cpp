#include "solver/mixed_response.hpp"

#include "solver/contact_kernel.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Touched bodies of one tree above which W, of their square, costs more than it gives.
constexpr int kMostTouched = 32;
// Joints may leave a row no freedom at all; what W then gives is rounding and what bodies have turned since it was built. So much of the
// free bodies' is added: sweeps go less far there, their fixed point is the same.
constexpr Real kLeastFreedom = 3e-3;

// out −= yᵀ z of n rows of six.
template <int N>
void subtract_product(const Real* y, const Real* z, Mat6& out) {
    const Eigen::Map<const Eigen::Matrix<Real, 6, N>> yt(y), zt(z);
    out -= yt.lazyProduct(zt.transpose());
}

Vec6 velocity_of(const BodyVelocity& u) {
    Vec6 v;
    v << u.v, u.w;
    return v;
}

}  // namespace

bool ContactResponse::gather(const JointRowList& rows, const JointPlan& plan, const ContactPool& contacts, BlockRange range,
                             const SolverBodies& bodies, int body_begin, int dynamic_end) {
    const auto is_dynamic = [&](int body) { return body >= body_begin && body < dynamic_end; };
    body_begin_ = body_begin;
    tree_of_.resize(dynamic_end - body_begin);
    touched_of_.assign(dynamic_end - body_begin, -1);
    for (int i = 0; i < dynamic_end - body_begin; ++i) tree_of_[i] = -1 - i;
    for (std::size_t i = 0; i < rows.list().size(); ++i) {
        int root = plan.pattern.turn(static_cast<int>(i));
        while (plan.pattern.parent(root) >= 0) root = plan.pattern.parent(root);
        for (int side = 0; side < 2; ++side)
            if (rows.list()[i].moves[side]) tree_of_[rows.list()[i].body[side] - body_begin] = root;
    }
    touched_.clear();
    for (int k = range.begin; k < range.end; ++k) {
        for (int body : {contacts.blocks[k].a, contacts.blocks[k].b}) {
            if (!is_dynamic(body) || touched_of_[body - body_begin] >= 0) continue;
            touched_of_[body - body_begin] = 0;
            touched_.push_back({body, tree_of_[body - body_begin]});
        }
    }
    std::sort(touched_.begin(), touched_.end(),
              [](const Touched& p, const Touched& q) { return p.tree != q.tree ? p.tree < q.tree : p.body < q.body; });
    groups_.clear();
    int blocks = 0;
    for (int i = 0; i < static_cast<int>(touched_.size()); ++i) {
        touched_of_[touched_[i].body - body_begin] = i;
        if (i == 0 || touched_[i].tree != touched_[i - 1].tree) groups_.push_back({i, i, 0});
        touched_[i].group = static_cast<int>(groups_.size()) - 1;
        groups_.back().end = i + 1;
    }
    for (Group& g : groups_) {
        const int n = g.end - g.begin;
        if (n > kMostTouched) return false;
        g.w = blocks;
        blocks += n * n;
    }
    W_.resize(blocks);
    sides_.resize(range.end - range.begin);
    fixed_.resize(range.end - range.begin);
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const auto touched = [&](int body) { return is_dynamic(body) ? touched_of_[body - body_begin] : -1; };
        sides_[k - range.begin] = {touched(block.a), touched(block.b)};
        const int fixed = is_dynamic(block.a) ? block.b : block.a;
        fixed_[k - range.begin] = velocity_of(bodies.velocity[fixed]);
    }
    rows_.resize(3 * points_of(contacts, range).count());
    velocity_.resize(touched_.size());
    f_.resize(touched_.size());
    gather_paths(rows, plan);
    return true;
}

// The ways of each touched body's joints to the root, in ascending order.
void ContactResponse::gather_paths(const JointRowList& rows, const JointPlan& plan) {
    const BlockPattern& pattern = plan.pattern;
    path_.clear();
    path_row_.clear();
    offset_.assign(pattern.count(), -1);
    int row = 0;
    for (Touched& t : touched_) {
        t.path_begin = static_cast<int>(path_.size());
        for (std::size_t i = 0; i < rows.list().size() && t.tree >= 0; ++i) {
            const JointRow& j = rows.list()[i];
            if (j.body[0] != t.body && j.body[1] != t.body) continue;
            for (int k = pattern.turn(static_cast<int>(i)); k >= 0 && offset_[k] != t.body; k = pattern.parent(k)) {
                offset_[k] = t.body;
                path_.push_back(k);
            }
        }
        t.path_end = static_cast<int>(path_.size());
        std::sort(path_.begin() + t.path_begin, path_.end());
        t.y = row;
        for (int p = t.path_begin; p < t.path_end; ++p) {
            path_row_.push_back(row);
            row += pattern.turn_size(path_[p]);
        }
    }
    Y_.resize(6 * row);
    Z_.resize(6 * row);
}

void ContactResponse::build(const JointRowList& rows, const JointPlan& plan, const BlockLdlt& ldlt, const SolverBodies& bodies) {
    std::fill(Y_.begin(), Y_.end(), 0.0);
    for (const Touched& t : touched_) {
        for (int p = t.path_begin; p < t.path_end; ++p) offset_[path_[p]] = path_row_[p];
        for (std::size_t i = 0; i < rows.list().size() && t.tree >= 0; ++i) {
            const JointRow& j = rows.list()[i];
            for (int side = 0; side < 2; ++side)
                if (j.body[side] == t.body) std::copy_n(j.W[side], 6 * j.n, &Y_[6 * offset_[plan.pattern.turn(static_cast<int>(i))]]);
        }
        ldlt.forward(path_.data() + t.path_begin, t.path_end - t.path_begin, offset_.data(), Y_.data(), Z_.data());
    }
    for (const Group& g : groups_) {
        const int n = g.end - g.begin;
        for (int i = g.begin; i < g.end; ++i) {
            for (int j = g.begin; j <= i; ++j) {
                Mat6& out = W_[g.w + (i - g.begin) * n + (j - g.begin)];
                product(touched_[i], touched_[j], plan.pattern, out);
                if (i == j) {
                    const BodyMotion& m = bodies.motion[touched_[i].body];
                    out.diagonal().head<3>().array() += m.inv_mass;
                    out.bottomRightCorner<3, 3>() += m.inv_inertia_W;
                } else {
                    W_[g.w + (j - g.begin) * n + (i - g.begin)] = out.transpose();
                }
            }
        }
    }
}

// −Y_iᵀ D⁻¹ Y_j over the turns that both ways have.
void ContactResponse::product(const Touched& i, const Touched& j, const BlockPattern& pattern, Mat6& out) const {
    out.setZero();
    for (int p = i.path_begin, q = j.path_begin; p < i.path_end && q < j.path_end;) {
        if (path_[p] < path_[q]) {
            ++p;
        } else if (path_[p] > path_[q]) {
            ++q;
        } else {
            const Real *y = &Y_[6 * path_row_[p]], *z = &Z_[6 * path_row_[q]];
            switch (pattern.turn_size(path_[p])) {
                case 1:
                    subtract_product<1>(y, z, out);
                    break;
                case 3:
                    subtract_product<3>(y, z, out);
                    break;
                case 5:
                    subtract_product<5>(y, z, out);
                    break;
                default:
                    subtract_product<6>(y, z, out);
            }
            ++p;
            ++q;
        }
    }
}

ContactResponse::Row ContactResponse::make_row(const Sides& sides, const Vec3& direction, const PointRow& point) const {
    Row row;
    row.J_a << direction, point.ang_a;
    row.J_b << -direction, -point.ang_b;
    row.Y_a.setZero();
    row.Y_b.setZero();
    if (sides.a >= 0) row.Y_a.noalias() += w(sides.a, sides.a) * row.J_a;
    if (sides.b >= 0) row.Y_b.noalias() += w(sides.b, sides.b) * row.J_b;
    if (sides.a >= 0 && sides.b >= 0 && touched_[sides.a].group == touched_[sides.b].group) {
        row.Y_a.noalias() += w(sides.a, sides.b) * row.J_b;
        row.Y_b.noalias() += w(sides.b, sides.a) * row.J_a;
    }
    const Real s = row.J_a.dot(row.Y_a) + row.J_b.dot(row.Y_b);
    row.mass = point.mass > 0 ? 1 / (s + kLeastFreedom / point.mass) : 0;
    return row;
}

void ContactResponse::build_rows(const ContactPool& contacts, BlockRange range) {
    const int first = points_of(contacts, range).begin;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const Sides& sides = sides_[k - range.begin];
        for (int i = 0; i < block.count; ++i) {
            Row* rows = &rows_[3 * (block.first + i - first)];
            rows[0] = make_row(sides, block.n, contacts.normals[block.first + i]);
            for (int j = 0; block.friction >= 0 && j < 2; ++j) {
                const FrictionRow& friction = contacts.frictions[block.friction + 2 * i + j];
                rows[1 + j] = make_row(sides, friction.t, friction);
            }
        }
    }
}

void ContactResponse::begin(const SolverBodies& bodies) {
    for (std::size_t i = 0; i < touched_.size(); ++i) {
        velocity_[i] = velocity_of(bodies.velocity[touched_[i].body]);
        f_[i].setZero();
    }
}

void ContactResponse::end(SolverBodies& bodies) const {
    for (std::size_t i = 0; i < touched_.size(); ++i) {
        const BodyMotion& m = bodies.motion[touched_[i].body];
        BodyVelocity& u = bodies.velocity[touched_[i].body];
        u.v += m.inv_mass * f_[i].head<3>();
        u.w += m.inv_inertia_W * f_[i].tail<3>();
    }
}

// An impulse on a touched body moves the others of its tree, but for `other`, which has been moved already.
void ContactResponse::spread(int touched, int other, const Vec6& f) {
    const Group& g = groups_[touched_[touched].group];
    for (int j = g.begin; j < g.end; ++j)
        if (j != touched && j != other) velocity_[j].noalias() += w(j, touched) * f;
}

template <typename TargetOf>
Real ContactResponse::sweep(ContactPool& contacts, BlockRange range, bool with_friction, TargetOf target_of) {
    const int first = points_of(contacts, range).begin;
    Real change = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const Sides& sides = sides_[k - range.begin];
        Vec6 a = sides.a >= 0 ? velocity_[sides.a] : fixed_[k - range.begin],
             b = sides.b >= 0 ? velocity_[sides.b] : fixed_[k - range.begin];
        Vec6 f_a = Vec6::Zero(), f_b = Vec6::Zero();
        bool any = false;
        const auto move = [&](const Row& row, Real& lambda, Real next) {
            const Real delta = next - lambda;
            if (delta == 0) return;
            any = true;
            lambda = next;
            a += delta * row.Y_a;
            b += delta * row.Y_b;
            f_a += delta * row.J_a;
            f_b += delta * row.J_b;
            if (row.mass > 0) change = std::max(change, std::abs(delta) / row.mass);
        };
        const Row* rows = &rows_[3 * (block.first - first)];
        for (int i = 0; i < block.count; ++i) {
            const Row& row = rows[3 * i];
            Real& lambda = contacts.impulse[block.first + i].normal;
            const Real v = row.J_a.dot(a) + row.J_b.dot(b);
            move(row, lambda, std::max(lambda - row.mass * (v - target_of(contacts.normals[block.first + i])), 0.0));
        }
        for (int i = 0; with_friction && block.friction >= 0 && i < block.count; ++i) {
            PointImpulse& impulse = contacts.impulse[block.first + i];
            const Real limit = block.mu * impulse.normal;
            if (limit == 0 && impulse.friction[0] == 0 && impulse.friction[1] == 0) continue;
            // Side by side, as in solver/contact_rows.cpp.
            const Row &row1 = rows[3 * i + 1], &row2 = rows[3 * i + 2];
            const Real v1 = row1.J_a.dot(a) + row1.J_b.dot(b), v2 = row2.J_a.dot(a) + row2.J_b.dot(b);
            const Real next1 = std::clamp(impulse.friction[0] - row1.mass * v1, -limit, limit);
            const Real next2 = std::clamp(impulse.friction[1] - row2.mass * v2, -limit, limit);
            move(row1, impulse.friction[0], next1);
            move(row2, impulse.friction[1], next2);
        }
        if (!any) continue;
        const bool together = sides.a >= 0 && sides.b >= 0 && touched_[sides.a].group == touched_[sides.b].group;
        if (sides.a >= 0) {
            velocity_[sides.a] = a;
            f_[sides.a] += f_a;
            spread(sides.a, together ? sides.b : sides.a, f_a);
        }
        if (sides.b >= 0) {
            velocity_[sides.b] = b;
            f_[sides.b] += f_b;
            spread(sides.b, together ? sides.a : sides.b, f_b);
        }
    }
    return change;
}

Real ContactResponse::sweep_gaps(ContactPool& contacts, BlockRange range, Real h, Real push_rate) {
    return sweep(contacts, range, false, [=](const NormalRow& row) { return gap_target(row, h, push_rate); });
}

Real ContactResponse::sweep_velocities(ContactPool& contacts, BlockRange range) {
    return sweep(contacts, range, true, [](const NormalRow& row) { return velocity_target(row); });
}

}  // namespace cairn
