#include "solver/wide_contacts.hpp"

#include "solver/block_order.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// Fewer blocks, or fewer blocks per batch, do not pay for the copies.
constexpr int kFewestBlocks = 12;
constexpr double kFewestLanes = 2;
// Places for blocks of a level by their number of points: of borders, then of the others.
constexpr int kCounts = 4, kSlots = 2 * kCounts;

static_assert(sizeof(PointState) == kStateStride * sizeof(double), "wide kernels read points as rows of four doubles");
static_assert(sizeof(BodyVelocity) == kVelocityStride * sizeof(double), "wide kernels read (v, w) as six doubles");

template <typename T>
void grow(std::vector<T>& v, std::size_t size) {
    if (v.size() < size) v.resize(size);
}

void set(WideVec& w, int lane, const Vec3& v) {
    w.x.lane[lane] = v.x();
    w.y.lane[lane] = v.y();
    w.z.lane[lane] = v.z();
}

Vec3 get(const WideVec& w, int lane) {
    return {w.x.lane[lane], w.y.lane[lane], w.z.lane[lane]};
}

PointRow get_row(const WideRow& row, int lane) {
    PointRow r;
    r.ang_a = get(row.ang_a, lane);
    r.ang_b = get(row.ang_b, lane);
    r.iang_a = get(row.iang_a, lane);
    r.iang_b = get(row.iang_b, lane);
    r.mass = row.mass.lane[lane];
    return r;
}

void copy_column(double* to, const Mat3& m, int column) {
    for (int i = 0; i < 3; ++i) to[i] = m(i, column);
}

}  // namespace

bool WideContacts::plan(const ContactPool& pool, BlockRange range, int body_begin, int body_end, const SolverBodies* bodies, Team* team) {
    const int count = range.end - range.begin;
    if (!kernel_ || count < kFewestBlocks) return false;
    grow(order_, count);
    next_level_.resize(body_end - body_begin);
    const int levels = find_levels({pool.blocks.data() + range.begin, static_cast<std::size_t>(count)}, body_begin, next_level_, level_);
    if (levels * kFewestLanes > count) return false;
    slots_.assign(levels, 0);
    for (int k = 0; k < count; ++k) ++slots_[level_[k]];
    int batches = 0;
    for (const int size : slots_) batches += (size + kLanes - 1) / kLanes;
    if (batches * kFewestLanes > count) return false;
    parts_.divide(pool, range, level_, levels, bodies, body_begin, body_end, team);
    sort_blocks(range, pool, levels);
    last_batch_.resize(body_end - body_begin);
    cut_batches(pool, levels, body_begin);
    return true;
}

// By part, by level, borders first, then by the number of points, so that a batch has few points that stand for nothing.
void WideContacts::sort_blocks(BlockRange range, const ContactPool& pool, int levels) {
    const auto slot = [&](int k) {
        const int row = (parts_.part_of(k) * levels + level_[k]) * 2 + (parts_.is_border(k) ? 0 : 1);
        return row * kCounts + kCounts - pool.blocks[range.begin + k].count;
    };
    const int count = range.end - range.begin;
    slots_.assign(parts_.count() * levels * kSlots + 1, 0);
    for (int k = 0; k < count; ++k) ++slots_[slot(k) + 1];
    for (std::size_t i = 1; i < slots_.size(); ++i) slots_[i] += slots_[i - 1];
    fill_ = slots_;
    sorted_.resize(count);
    for (int k = 0; k < count; ++k) sorted_[fill_[slot(k)]++] = range.begin + k;
}

// Batches of four from each level of each part. What is free in a level's last one is filled from the next level, as far as that waits for
// nothing in this batch: its bodies have been seen last in earlier ones. Not from borders, which wait for other parts.
void WideContacts::cut_batches(const ContactPool& pool, int levels, int body_begin) {
    constexpr int kMostLooks = 32;
    std::fill(last_batch_.begin(), last_batch_.end(), -1);
    placed_.assign(sorted_.size(), 0);
    batch_begin_.clear();
    parts_.begin_batches();
    int size = 0, lanes = kLanes;  // of order_, and in use of the last batch
    const auto put = [&](int i) {
        if (lanes == kLanes) {
            batch_begin_.push_back(size);
            lanes = 0;
        }
        ++lanes;
        placed_[i] = 1;
        order_[size++] = sorted_[i];
        const ContactBlock& block = pool.blocks[sorted_[i]];
        const int batch = static_cast<int>(batch_begin_.size()) - 1;
        if (block.inv_mass_a > 0) last_batch_[block.a - body_begin] = batch;
        if (block.inv_mass_b > 0) last_batch_[block.b - body_begin] = batch;
    };
    const auto fits = [&](int i) {
        const ContactBlock& block = pool.blocks[sorted_[i]];
        const int batch = static_cast<int>(batch_begin_.size()) - 1;
        return (block.inv_mass_a == 0 || last_batch_[block.a - body_begin] < batch) &&
               (block.inv_mass_b == 0 || last_batch_[block.b - body_begin] < batch) &&
               block.count <= pool.blocks[order_[batch_begin_.back()]].count;
    };
    for (int row = 0; row < parts_.count() * levels; ++row) {
        const int inner = slots_[row * kSlots + kCounts], end = slots_[(row + 1) * kSlots];
        const int first = static_cast<int>(batch_begin_.size());
        lanes = kLanes;
        for (int i = slots_[row * kSlots]; i < inner; ++i) put(i);
        const int border = static_cast<int>(batch_begin_.size());
        for (int i = inner; i < end; ++i)
            if (!placed_[i]) put(i);
        if ((row + 1) % levels != 0 && size > 0) {
            const int next = slots_[(row + 1) * kSlots + kCounts], next_end = std::min(slots_[(row + 2) * kSlots], next + kMostLooks);
            for (int i = next; i < next_end && lanes < kLanes; ++i)
                if (fits(i)) put(i);
        }
        const int last = static_cast<int>(batch_begin_.size());
        if (border > first) parts_.add_batches(row / levels, row % levels, true, first, border);
        if (last > border) parts_.add_batches(row / levels, row % levels, false, border, last);
    }
    batch_begin_.push_back(size);
}

void WideContacts::pack(const ContactPool& pool, SolverBodies& bodies, int begin, int end, const PointLoad& load) {
    result_scale_ = 1;
    const int batches = batch_count();
    grow(batches_, batches);
    grow(builds_, batches);
    int points = 0, frictions = 0;
    for (int k = 0; k < batches; ++k) {
        WideBatch& batch = batches_[k];
        batch.first = points;
        batch.count = 0;
        bool rubs = false;
        for (int i = batch_begin_[k]; i < batch_begin_[k + 1]; ++i) {
            const ContactBlock& block = pool.blocks[order_[i]];
            batch.count = std::max(batch.count, block.count);
            rubs |= block.friction >= 0;
        }
        batch.friction = rubs ? frictions : -1;
        points += batch.count;
        if (rubs) frictions += 2 * batch.count;
    }
    point_count_ = points;
    grow(normals_, points);
    grow(points_, points);
    grow(warm_, points);
    grow(total_, points);
    grow(normal_impulse_, points);
    grow(normal_held_, points);
    grow(frictions_, frictions);
    grow(friction_impulse_, frictions);
    grow(friction_held_, frictions);
    grow(poses_, bodies.motion.size());
    copy_poses(bodies, kImmovable, kImmovable + 1);
    copy_poses(bodies, begin, end);
    view_ = {batches_.data(),
             builds_.data(),
             normals_.data(),
             frictions_.data(),
             points_.data(),
             normal_impulse_.data(),
             friction_impulse_.data(),
             normal_held_.data(),
             friction_held_.data(),
             warm_.data(),
             total_.data(),
             bodies.velocity.data()->v.data(),
             poses_.data(),
             {load.dt, load.warm_scale, load.friction == FrictionModel::kPyramidFixed}};
    parts_.each_batch([&](int first, int last) {
        for (int k = first; k < last; ++k) pack_batch(pool, k);
        kernel_->build(view_, first, last);
    });
}

// Lanes without a block stay zero: with mass 0 they take no impulse.
void WideContacts::pack_batch(const ContactPool& pool, int k) {
    const WideBatch shape = batches_[k];
    WideBatch& batch = batches_[k] = {};
    WideBatchBuild& build = builds_[k] = {};
    batch.first = shape.first;
    batch.count = shape.count;
    batch.friction = shape.friction;
    for (int l = 0; l < kLanes; ++l) batch.a[l] = batch.b[l] = kImmovable;
    for (int l = 0; l < lanes_of(k); ++l) {
        const ContactBlock& block = pool.blocks[block_of(k, l)];
        batch.a[l] = block.a;
        batch.b[l] = block.b;
        batch.moves_a |= static_cast<unsigned>(block.inv_mass_a > 0) << l;
        batch.moves_b |= static_cast<unsigned>(block.inv_mass_b > 0) << l;
        set(batch.n, l, block.n);
        batch.inv_mass_sum.lane[l] = block.inv_mass_sum;
        batch.share_a.lane[l] = block.share_a;
        batch.share_b.lane[l] = block.share_b;
        batch.mu.lane[l] = block.friction >= 0 ? block.mu : 0;
        set(build.n_local, l, block.n_local);
        build.turns_with_a.lane[l] = block.frame == NormalFrame::kA;
        build.turns_with_b.lane[l] = block.frame == NormalFrame::kB;
        build.states[l] = reinterpret_cast<double*>(block.states);
        build.posed[l] = reinterpret_cast<const double*>(posed_states(pool, block));
        build.counts[l] = block.count;
    }
}

Real WideContacts::largest_warm() const {
    Real largest = 0;
    for (int p = 0; p < point_count_; ++p)
        for (int l = 0; l < kLanes; ++l)
            largest = std::max({largest, warm_[p].position.lane[l], warm_[p].position.lane[l] + warm_[p].velocity.lane[l]});
    return largest;
}

void WideContacts::scale_warm(Real scale) {
    for (int p = 0; p < point_count_; ++p)
        for (int l = 0; l < kLanes; ++l) {
            warm_[p].position.lane[l] *= scale;
            warm_[p].velocity.lane[l] *= scale;
            for (int j = 0; j < 2; ++j) {
                warm_[p].friction[j].lane[l] *= scale;
                warm_[p].friction_first[j].lane[l] *= scale;
            }
        }
}

void WideContacts::store() {
    parts_.each_batch([&](int first, int last) { kernel_->store(view_, first, last, result_scale_); });
}

void WideContacts::unpack_rows(ContactPool& pool) const {
    for (int k = 0; k < batch_count(); ++k)
        for (int l = 0; l < lanes_of(k); ++l) {
            const WideBatch& batch = batches_[k];
            ContactBlock& block = pool.blocks[block_of(k, l)];
            block.n = get(batch.n, l);
            for (int i = 0; i < block.count; ++i) {
                const int p = batch.first + i;
                NormalRow& row = pool.normals[block.first + i] = {};
                static_cast<PointRow&>(row) = get_row(normals_[p], l);
                row.separation = points_[p].separation.lane[l];
                row.touching = std::isfinite(normals_[p].target.lane[l]);
                PointImpulse& impulse = pool.impulse[block.first + i] = {};
                impulse.normal = normal_impulse_[p].lane[l];
                for (int j = 0; j < 2 && block.friction >= 0; ++j) {
                    const int f = batch.friction + 2 * i + j;
                    FrictionRow& friction = pool.frictions[block.friction + 2 * i + j];
                    static_cast<PointRow&>(friction) = get_row(frictions_[f], l);
                    friction.t = get(frictions_[f].t, l);
                    impulse.friction[j] = friction_impulse_[f].lane[l];
                }
            }
        }
}

void WideContacts::forget_warm_start() {
    std::fill(warm_.begin(), warm_.end(), WideWarm{});
}

void WideContacts::keep_impulse_share(Real share) {
    const auto keep = [share](std::vector<Wide>& impulse, const std::vector<Wide>& held) {
        for (std::size_t k = 0; k < impulse.size(); ++k)
            for (int l = 0; l < kLanes; ++l) impulse[k].lane[l] = held[k].lane[l] + share * (impulse[k].lane[l] - held[k].lane[l]);
    };
    keep(normal_impulse_, normal_held_);
    keep(friction_impulse_, friction_held_);
}

void WideContacts::copy_poses(const SolverBodies& bodies, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        const BodyMotion& m = bodies.motion[i];
        WidePose& pose = poses_[i];
        for (int j = 0; j < 3; ++j) pose.x[j] = m.x[j];
        pose.inv_mass = m.inv_mass;
        pose.turned = m.turned;
        copy_column(pose.R0, m.R, 0);
        copy_column(pose.R1, m.R, 1);
        copy_column(pose.R2, m.R, 2);
        copy_column(pose.I0, m.inv_inertia_W, 0);
        copy_column(pose.I1, m.inv_inertia_W, 1);
        copy_column(pose.I2, m.inv_inertia_W, 2);
        const Vec3 acceleration = m.inv_mass > 0 ? m.acceleration : Vec3(Vec3::Zero());
        pose.acceleration_x = acceleration.x();
        pose.acceleration_y = acceleration.y();
        pose.acceleration_z = acceleration.z();
    }
}

const WideKernel* best_wide_kernel() {
#if defined(__x86_64__)
    static const bool has_avx2 = __builtin_cpu_supports("avx2");
    if (has_avx2) return &kAvx2WideKernel;
#endif
    return nullptr;
}

}  // namespace cairn
