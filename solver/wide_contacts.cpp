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

template <typename T>
void prefetch_lines(const T* first, int count) {
    constexpr std::size_t kLine = 64;
    for (std::size_t at = 0; at < count * sizeof(T); at += kLine) __builtin_prefetch(reinterpret_cast<const char*>(first) + at);
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

void WideContacts::pack(const ContactPool& pool, SolverBodies& bodies, int begin, int end) {
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
    grow(normals_, points);
    grow(points_, points);
    grow(warm_, points);
    grow(total_, points);
    grow(normal_impulse_, points);
    grow(normal_held_, points);
    grow(frictions_, frictions);
    grow(friction_impulse_, frictions);
    grow(friction_held_, frictions);
    parts_.each_batch([&](int first, int last) {
        for (int k = first; k < last; ++k) {
            if (k + 2 < last) prefetch_blocks(pool, k + 2);
            pack_batch(pool, k);
        }
    });
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
             poses_.data()};
    parts_.each_batch([&](int first, int last) { kernel_->build(view_, first, last); });
}

// Lanes without a block, and points that a lane does not have, are zero: with mass 0 they take no impulse.
void WideContacts::clear_batch(const WideBatch& batch) {
    for (int p = batch.first; p < batch.first + batch.count; ++p) {
        points_[p] = {};
        warm_[p] = {};
    }
    for (int f = batch.friction; batch.friction >= 0 && f < batch.friction + 2 * batch.count; ++f) frictions_[f].t = {};
}

// Whether every lane has a block, with friction if any has it, of as many points as any has: nothing needs to be cleared.
bool WideContacts::is_full(const ContactPool& pool, int k) const {
    if (lanes_of(k) < kLanes) return false;
    for (int l = 0; l < kLanes; ++l) {
        const ContactBlock& block = pool.blocks[block_of(k, l)];
        if (block.count < batches_[k].count || (block.friction < 0 && batches_[k].friction >= 0)) return false;
    }
    return true;
}

// The blocks of a batch lie apart in the pool, where no prefetcher of the machine expects them.
void WideContacts::prefetch_blocks(const ContactPool& pool, int k) const {
    for (int l = 0; l < lanes_of(k); ++l) {
        const ContactBlock& block = pool.blocks[block_of(k, l)];
        prefetch_lines(&pool.geometry[block.first], block.count);
        prefetch_lines(&pool.warm[block.first], block.count);
    }
}

void WideContacts::pack_batch(const ContactPool& pool, int k) {
    const WideBatch shape = batches_[k];
    WideBatch& batch = batches_[k] = {};
    WideBatchBuild& build = builds_[k] = {};
    batch.first = shape.first;
    batch.count = shape.count;
    batch.friction = shape.friction;
    if (!is_full(pool, k)) clear_batch(batch);
    std::fill_n(total_.begin() + batch.first, batch.count, WideImpulse{});
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
        for (int i = 0; i < block.count; ++i) pack_point(pool, block, i, batch, l);
    }
}

void WideContacts::pack_point(const ContactPool& pool, const ContactBlock& block, int i, const WideBatch& batch, int lane) {
    const PointGeometry& geometry = pool.geometry[block.first + i];
    const WarmImpulse& warm = pool.warm[block.first + i];
    const int p = batch.first + i;
    WidePoint& point = points_[p];
    set(point.core_a, lane, geometry.core_a_A);
    set(point.core_b, lane, geometry.core_b_B);
    point.radius_a.lane[lane] = geometry.radius_a;
    point.radius_b.lane[lane] = geometry.radius_b;
    point.is_used.lane[lane] = 1;
    WideWarm& w = warm_[p];
    w.position.lane[lane] = warm.position;
    w.velocity.lane[lane] = warm.velocity;
    const bool rubs = warm.friction[0] != 0 || warm.friction[1] != 0;
    if (block.friction < 0) return;
    set(frictions_[batch.friction + 2 * i].t, lane, geometry.t1);
    set(frictions_[batch.friction + 2 * i + 1].t, lane, block.n.cross(geometry.t1));
    for (int j = 0; j < 2; ++j) {
        w.friction[j].lane[lane] = warm.friction[j];
        w.friction_first[j].lane[lane] = rubs ? warm.friction_first[j] : 0;
    }
}

// Which sign a zero has may depend on what else is in its batch: all get the same, by + 0.0.
WideContacts::Result WideContacts::result(int batch, int lane, int i) const {
    const WideBatch& b = batches_[batch];
    const WideWarm& warm = warm_[b.first + i];
    const WideImpulse& total = total_[b.first + i];
    Result r;
    r.warm.position = result_scale_ * warm.position.lane[lane] + 0.0;
    r.warm.velocity = result_scale_ * warm.velocity.lane[lane] + 0.0;
    r.total.normal = total.normal.lane[lane] + 0.0;
    for (int j = 0; j < 2; ++j) {
        r.warm.friction[j] = result_scale_ * warm.friction[j].lane[lane] + 0.0;
        r.warm.friction_first[j] = result_scale_ * warm.friction_first[j].lane[lane] + 0.0;
        r.total.friction[j] = total.friction[j].lane[lane] + 0.0;
        r.t[j] = b.friction >= 0 ? get(frictions_[b.friction + 2 * i + j].t, lane) : Vec3(Vec3::Zero());
    }
    return r;
}

void WideContacts::unpack(ContactPool& pool) const {
    for (int k = 0; k < batch_count(); ++k)
        for (int l = 0; l < lanes_of(k); ++l) {
            const ContactBlock& block = pool.blocks[block_of(k, l)];
            for (int i = 0; i < block.count; ++i) {
                const Result r = result(k, l, i);
                pool.warm[block.first + i] = r.warm;
                pool.total[block.first + i] = r.total;
                for (int j = 0; j < 2 && block.friction >= 0; ++j) pool.frictions[block.friction + 2 * i + j].t = r.t[j];
            }
        }
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
