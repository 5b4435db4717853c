#include "solver/tree_contacts.hpp"

#include "solver/contact_kernel.hpp"

#include <algorithm>

namespace cairn {
namespace {

constexpr int kPad = 4;
// Numbers a row, on average, above which turns of sweeps and joints are cheaper.
constexpr int kMostLength = 96;
// Joints may leave a row no freedom at all; what is left then is rounding and what bodies have turned since it was built. So much of the
// free bodies' is added: sweeps go less far there, their fixed point is the same.
constexpr Real kLeastFreedom = 3e-3;

typedef Real Pair __attribute__((vector_size(16), may_alias));

// Of `length` numbers, a multiple of four, in an order that does not depend on the instruction set.
inline Real dot(const Real* a, const Real* b, int length) {
    Pair s = {0, 0}, t = {0, 0};
    for (int i = 0; i < length; i += kPad) {
        s += *reinterpret_cast<const Pair*>(a + i) * *reinterpret_cast<const Pair*>(b + i);
        t += *reinterpret_cast<const Pair*>(a + i + 2) * *reinterpret_cast<const Pair*>(b + i + 2);
    }
    s += t;
    return s[0] + s[1];
}

inline void add_scaled(Real* z, Real f, const Real* y, int length) {
    const Pair ff = {f, f};
    for (int i = 0; i < length; i += 2) *reinterpret_cast<Pair*>(z + i) += ff * *reinterpret_cast<const Pair*>(y + i);
}

}  // namespace

bool TreeContacts::gather(const JointTree& tree, const ContactPool& contacts, BlockRange range, int body_begin, int dynamic_end) {
    const auto node = [&](int body) { return body >= body_begin && body < dynamic_end ? tree.node_of(body) : -1; };
    parts_.clear();
    ways_.resize(range.end - range.begin);
    int values = 0, rows = 0, longest = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        Way& way = ways_[k - range.begin];
        way = {node(block.a), node(block.b), static_cast<int>(parts_.size()), 0, 0, values, rows, block.friction >= 0 ? 3 : 1};
        int ends[2] = {way.a, way.b};
        while (ends[0] >= 0 || ends[1] >= 0) {
            const bool meets = ends[0] == ends[1];
            const int side = ends[0] >= ends[1] ? 0 : 1;
            const JointTree::Node& n = tree.nodes()[ends[side]];
            if (n.dofs > 0 || meets) parts_.push_back({ends[side], n.z, n.dofs, way.length, side, meets});
            way.length += n.dofs;
            ends[side] = n.parent;
            if (meets) ends[1 - side] = -1;
        }
        way.end = static_cast<int>(parts_.size());
        way.length = (way.length + kPad - 1) / kPad * kPad;
        longest = std::max(longest, way.length);
        values += block.count * way.rows_a_point * way.length;
        rows += block.count * way.rows_a_point;
    }
    if (values > kMostLength * rows) return false;
    rows_.resize(rows);
    values_.assign(values, 0);
    local_.assign(longest, 0);
    z_.resize(tree.dofs());
    return true;
}

template <int R>
void TreeContacts::build_point(const JointTree& tree, const Way& way, const ContactBlock& block, const PointRow* const* rows,
                               int first_row) {
    Eigen::Matrix<Real, 6, R> F[2];
    for (int r = 0; r < R; ++r) {
        const Vec3& direction = r == 0 ? block.n : static_cast<const FrictionRow*>(rows[r])->t;
        if (way.a >= 0) F[0].col(r) << direction, rows[r]->ang_a + tree.nodes()[way.a].arm.cross(direction);
        if (way.b >= 0) F[1].col(r) << -direction, -rows[r]->ang_b - tree.nodes()[way.b].arm.cross(direction);
    }
    Real* values = &values_[way.values + (first_row - way.row) * way.length];
    const auto pass = [&](auto dofs, const Part& part) {
        constexpr int K = decltype(dofs)::value;
        const JointTree::Node& n = tree.nodes()[part.node];
        const Eigen::Map<const Eigen::Matrix<Real, 6, K>, Eigen::Aligned16> S(n.S.data()), U(n.U.data());
        Eigen::Matrix<Real, 6, R>& f = F[part.side];
        Eigen::Matrix<Real, K, R> y = S.transpose().lazyProduct(f);
        if (n.parent >= 0) f -= U.lazyProduct(y);
        for (int r = 0; r < R; ++r)
            for (int d = 0; d < K; ++d) values[r * way.length + part.at + d] = y(d, r);
    };
    for (int p = way.begin; p < way.end; ++p) {
        const Part& part = parts_[p];
        if (part.meets) F[part.side] += F[1 - part.side];
        switch (part.dofs) {
            case 0:
                break;
            case 1:
                pass(std::integral_constant<int, 1>(), part);
                break;
            case 3:
                pass(std::integral_constant<int, 3>(), part);
                break;
            case 5:
                pass(std::integral_constant<int, 5>(), part);
                break;
            default:
                pass(std::integral_constant<int, 6>(), part);
        }
    }
    for (int r = 0; r < R; ++r) {
        const Real* y = values + r * way.length;
        rows_[first_row + r].mass = rows[r]->mass > 0 ? 1 / (dot(y, y, way.length) + kLeastFreedom / rows[r]->mass) : 0;
    }
}

void TreeContacts::build(const JointTree& tree, const ContactPool& contacts, BlockRange range) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const Way& way = ways_[k - range.begin];
        for (int i = 0; i < block.count; ++i) {
            const PointRow* rows[3] = {&contacts.normals[block.first + i], nullptr, nullptr};
            const int first_row = way.row + way.rows_a_point * i;
            if (block.friction < 0) {
                build_point<1>(tree, way, block, rows, first_row);
                continue;
            }
            for (int j = 0; j < 2; ++j) rows[1 + j] = &contacts.frictions[block.friction + 2 * i + j];
            build_point<3>(tree, way, block, rows, first_row);
        }
    }
}

void TreeContacts::begin(const ContactPool& contacts, BlockRange range, const SolverBodies& bodies, bool with_friction) {
    std::fill(z_.begin(), z_.end(), 0.0);
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const Way& way = ways_[k - range.begin];
        const BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            Row* rows = &rows_[way.row + way.rows_a_point * i];
            rows[0].velocity = u.along(block.n, contacts.normals[block.first + i]);
            for (int j = 0; with_friction && block.friction >= 0 && j < 2; ++j) {
                const FrictionRow& friction = contacts.frictions[block.friction + 2 * i + j];
                rows[1 + j].velocity = u.along(friction.t, friction);
            }
        }
    }
}

template <typename TargetOf>
Real TreeContacts::sweep(ContactPool& contacts, BlockRange range, bool with_friction, TargetOf target_of) {
    Real change = 0;
    Real* z = local_.data();
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const Way& way = ways_[k - range.begin];
        const int length = way.length;
        for (int p = way.begin; p < way.end; ++p) {
            const Part& part = parts_[p];
            for (int d = 0; d < part.dofs; ++d) z[part.at + d] = z_[part.z + d];
        }
        bool any = false;
        const Real* values = &values_[way.values];
        const auto move = [&](const Row& row, const Real* y, Real& lambda, Real next) {
            const Real delta = next - lambda;
            if (delta == 0) return;
            any = true;
            lambda = next;
            add_scaled(z, delta, y, length);
            if (row.mass > 0) change = std::max(change, std::abs(delta) / row.mass);
        };
        const Row* rows = &rows_[way.row];
        const int stride = way.rows_a_point * length;
        for (int i = 0; i < block.count; ++i) {
            const Row& row = rows[way.rows_a_point * i];
            const Real* y = values + i * stride;
            Real& lambda = contacts.impulse[block.first + i].normal;
            const Real v = row.velocity + dot(y, z, length);
            move(row, y, lambda, std::max(lambda - row.mass * (v - target_of(contacts.normals[block.first + i])), 0.0));
        }
        for (int i = 0; with_friction && block.friction >= 0 && i < block.count; ++i) {
            PointImpulse& impulse = contacts.impulse[block.first + i];
            const Real limit = block.mu * impulse.normal;
            if (limit == 0 && impulse.friction[0] == 0 && impulse.friction[1] == 0) continue;
            // Side by side, as in solver/contact_rows.cpp.
            const Row &row1 = rows[3 * i + 1], &row2 = rows[3 * i + 2];
            const Real *y1 = values + i * stride + length, *y2 = y1 + length;
            const Real v1 = row1.velocity + dot(y1, z, length), v2 = row2.velocity + dot(y2, z, length);
            const Real next1 = std::clamp(impulse.friction[0] - row1.mass * v1, -limit, limit);
            const Real next2 = std::clamp(impulse.friction[1] - row2.mass * v2, -limit, limit);
            move(row1, y1, impulse.friction[0], next1);
            move(row2, y2, impulse.friction[1], next2);
        }
        if (!any) continue;
        for (int p = way.begin; p < way.end; ++p) {
            const Part& part = parts_[p];
            for (int d = 0; d < part.dofs; ++d) z_[part.z + d] = z[part.at + d];
        }
    }
    return change;
}

Real TreeContacts::sweep_gaps(ContactPool& contacts, BlockRange range, Real h, Real push_rate) {
    return sweep(contacts, range, false, [=](const NormalRow& row) { return gap_target(row, h, push_rate); });
}

Real TreeContacts::sweep_velocities(ContactPool& contacts, BlockRange range) {
    return sweep(contacts, range, true, [](const NormalRow& row) { return velocity_target(row); });
}

void TreeContacts::note_impulses(const ContactPool& contacts, BlockRange range, bool since_held, JointTree& tree) const {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const Way& way = ways_[k - range.begin];
        Vec3 force = Vec3::Zero(), moment_a = Vec3::Zero(), moment_b = Vec3::Zero();
        const auto add = [&](const Vec3& direction, const PointRow& row, Real lambda) {
            force += lambda * direction;
            moment_a += lambda * row.ang_a;
            moment_b += lambda * row.ang_b;
        };
        for (int i = 0; i < block.count; ++i) {
            const PointImpulse& impulse = contacts.impulse[block.first + i];
            const NormalRow& normal = contacts.normals[block.first + i];
            add(block.n, normal, impulse.normal - (since_held ? normal.held_impulse : 0));
            for (int j = 0; j < 2 && block.friction >= 0; ++j) {
                const FrictionRow& row = contacts.frictions[block.friction + 2 * i + j];
                add(row.t, row, impulse.friction[j] - (since_held ? row.held_impulse : 0));
            }
        }
        if (way.a >= 0) tree.note_impulse(way.a, force, moment_a);
        if (way.b >= 0) tree.note_impulse(way.b, -force, -moment_b);
    }
}

}  // namespace cairn
