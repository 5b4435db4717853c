#include "solver/tree_contacts.hpp"

#include "solver/contact_kernel.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Numbers a row, on average, above which turns of sweeps and joints are cheaper.
constexpr int kMostLength = 96;
// Joints may leave a row no freedom at all; what is left then is rounding and what bodies have turned since it was built. So much of the
// free bodies' is added: sweeps go less far there, their fixed point is the same.
constexpr Real kLeastFreedom = 3e-3;

static_assert(sizeof(PointImpulse) == 3 * sizeof(Real));

}  // namespace

const TreeKernel* best_tree_kernel() {
#if defined(__x86_64__)
    static const bool has_avx2 = __builtin_cpu_supports("avx2");
    if (has_avx2) return &kAvx2TreeKernel;
#endif
    return &kPortableTreeKernel;
}

// The nodes from two bodies to their roots, where they meet but once; parents come after what hangs from them.
void TreeContacts::add_way(const JointTree& tree, int a, int b, TreeBlock& block) {
    int ends[2] = {a, b}, length = 0;
    block.part_begin = static_cast<int>(parts_.size());
    block.pair = static_cast<int>(pairs_.size());
    while (ends[0] >= 0 || ends[1] >= 0) {
        const bool meets = ends[0] == ends[1];
        const int side = ends[0] >= ends[1] ? 0 : 1;
        const JointTree::Node& n = tree.nodes()[ends[side]];
        if (n.dofs > 0 || meets) parts_.push_back({n.S.data(), n.U.data(), n.dofs, length, side, meets, n.parent < 0});
        for (int d = 0; d < n.dofs; d += 2) pairs_.push_back(n.z + d);
        length += (n.dofs + 1) / 2 * 2;
        ends[side] = n.parent;
        if (meets) ends[1 - side] = -1;
    }
    block.part_end = static_cast<int>(parts_.size());
    block.quads = (length + kTreePad - 1) / kTreePad;
    block.is_padded = length < kTreePad * block.quads;
    if (block.is_padded) pairs_.push_back(tree.dofs());
}

bool TreeContacts::gather(const JointTree& tree, const ContactPool& contacts, BlockRange range, int body_begin, int dynamic_end) {
    const auto node = [&](int body) { return body >= body_begin && body < dynamic_end ? tree.node_of(body) : -1; };
    parts_.clear();
    pairs_.clear();
    count_ = range.end - range.begin;
    if (static_cast<int>(blocks_.size()) < count_) {
        blocks_.resize(count_);
        nodes_.resize(2 * count_);
    }
    int values = 0, rows = 0, longest = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        TreeBlock& own = blocks_[k - range.begin];
        int* ends = &nodes_[2 * (k - range.begin)];
        ends[0] = node(block.a);
        ends[1] = node(block.b);
        add_way(tree, ends[0], ends[1], own);
        own.arm_a = ends[0] >= 0 ? tree.nodes()[ends[0]].arm.data() : nullptr;
        own.arm_b = ends[1] >= 0 ? tree.nodes()[ends[1]].arm.data() : nullptr;
        own.mu = block.mu;
        own.values = values;
        own.row = rows;
        own.point = block.first;
        own.count = block.count;
        own.has_friction = block.friction >= 0;
        longest = std::max(longest, own.quads);
        const int own_rows = block.count * (own.has_friction ? kTreeRowsAPoint : 1);
        values += own_rows * kTreePad * own.quads;
        rows += own_rows;
    }
    if (values > kMostLength * rows) return false;
    if (static_cast<int>(rows_.size()) < rows) rows_.resize(rows);
    if (static_cast<int>(values_.size()) < values) values_.resize(values);
    scratch_.resize(longest);
    z_.assign(tree.dofs() + 2, 0);
    return true;
}

void TreeContacts::build(const ContactPool& contacts, BlockRange range) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const TreeBlock& own = blocks_[k - range.begin];
        const int rows_a_point = own.has_friction ? kTreeRowsAPoint : 1;
        for (int i = 0; i < block.count; ++i) {
            TreePoint point;
            for (int r = 0; r < kTreeRowsAPoint; ++r) {
                const bool is_normal = r == 0 || !own.has_friction;
                const FrictionRow* friction = is_normal ? nullptr : &contacts.frictions[block.friction + 2 * i + r - 1];
                const PointRow& row = is_normal ? static_cast<const PointRow&>(contacts.normals[block.first + i]) : *friction;
                point.direction[r] = is_normal ? block.n.data() : friction->t.data();
                point.ang_a[r] = row.ang_a.data();
                point.ang_b[r] = row.ang_b.data();
                point.softness[r] = kLeastFreedom / row.mass;  // ∞ where nothing can move: it never does
            }
            const int row = rows_a_point * i;
            kernel_->build(own, parts_.data(), point, &values_[own.values + row * kTreePad * own.quads], &rows_[own.row + row]);
        }
    }
}

void TreeContacts::begin(const ContactPool& contacts, BlockRange range) {
    const PointRange points = points_of(contacts, range);
    std::fill(z_.begin(), z_.end(), 0.0);
    start_.assign(contacts.impulse.begin() + points.begin, contacts.impulse.begin() + points.end);
}

void TreeContacts::begin_gaps(const ContactPool& contacts, BlockRange range, const SolverBodies& bodies, Real h, Real push_rate) {
    begin(contacts, range);
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const TreeBlock& own = blocks_[k - range.begin];
        const BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            const NormalRow& row = contacts.normals[block.first + i];
            rows_[own.row + (own.has_friction ? kTreeRowsAPoint : 1) * i].aim = gap_target(row, h, push_rate) - u.along(block.n, row);
        }
    }
}

void TreeContacts::begin_velocities(const ContactPool& contacts, BlockRange range, const SolverBodies& bodies) {
    begin(contacts, range);
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const TreeBlock& own = blocks_[k - range.begin];
        const BlockVelocity u(block, bodies);
        TreeRow* rows = &rows_[own.row];
        for (int i = 0; i < block.count; ++i) {
            const NormalRow& row = contacts.normals[block.first + i];
            rows++->aim = velocity_target(row) - u.along(block.n, row);
            for (int j = 0; own.has_friction && j < 2; ++j) {
                const FrictionRow& friction = contacts.frictions[block.friction + 2 * i + j];
                rows++->aim = -u.along(friction.t, friction);
            }
        }
    }
}

Real TreeContacts::sweep(ContactPool& contacts, bool with_friction) {
    return kernel_->sweep({blocks_.data(), count_, pairs_.data(), values_.data(), rows_.data(), &contacts.impulse.data()->normal, z_.data(),
                           scratch_.data()->lane},
                          with_friction);
}

void TreeContacts::note_impulses(const ContactPool& contacts, BlockRange range, bool with_friction, JointTree& tree) const {
    const int first = points_of(contacts, range).begin;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        const int *nodes = &nodes_[2 * (k - range.begin)], a = nodes[0], b = nodes[1];
        Vec3 force = Vec3::Zero(), moment_a = Vec3::Zero(), moment_b = Vec3::Zero();
        const auto add = [&](const Vec3& direction, const PointRow& row, Real lambda) {
            force += lambda * direction;
            moment_a += lambda * row.ang_a;
            moment_b += lambda * row.ang_b;
        };
        for (int i = 0; i < block.count; ++i) {
            const PointImpulse& impulse = contacts.impulse[block.first + i];
            const PointImpulse& start = start_[block.first + i - first];
            add(block.n, contacts.normals[block.first + i], impulse.normal - start.normal);
            for (int j = 0; j < 2 && with_friction && block.friction >= 0; ++j) {
                const FrictionRow& row = contacts.frictions[block.friction + 2 * i + j];
                add(row.t, row, impulse.friction[j] - start.friction[j]);
            }
        }
        if (a >= 0) tree.note_impulse(a, force, moment_a);
        if (b >= 0) tree.note_impulse(b, -force, -moment_b);
    }
}

}  // namespace cairn
