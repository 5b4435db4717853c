#include "solver/wide_parts.hpp"

#include "solver/wide_data.hpp"

#include <array>
#include <cmath>
#include <numeric>

namespace cairn {
namespace {

// Fewer blocks to a part do not pay for the waiting between stages.
constexpr int kFewestBlocks = 100;
// The longest way through the parts must be at most this share of the whole, times how evenly it could be dealt out.
constexpr double kMostShare = 1.4;
constexpr double kMostBorder = 0.4;  // share of the blocks
constexpr int kBins = 512;

}  // namespace

// Cuts across an axis, so that all parts have about as many points. False: the bodies lie in one place.
bool WideParts::cut(const SolverBodies& bodies, int axis, Extent extent, int body_begin, int body_end, int count) {
    const int n = body_end - body_begin;
    const Real scale = kBins / (extent.hi - extent.lo);
    if (!std::isfinite(scale)) return false;
    const auto bin = [&](int i) {
        return std::min(static_cast<int>(scale * (bodies.motion[body_begin + i].x[axis] - extent.lo)), kBins - 1);
    };
    std::array<double, kBins> sum{};
    for (int i = 0; i < n; ++i) sum[bin(i)] += weight_[i];
    std::partial_sum(sum.begin(), sum.end(), sum.begin());
    std::array<std::uint8_t, kBins> part;
    for (int b = 0; b < kBins; ++b) {
        const double middle = 0.5 * (sum[b] + (b > 0 ? sum[b - 1] : 0));
        part[b] = static_cast<std::uint8_t>(std::min(static_cast<int>(count * middle / sum.back()), count - 1));
    }
    for (int i = 0; i < n; ++i) part_of_body_[i] = part[bin(i)];
    return true;
}

// A block goes to the lower part of its two bodies; it belongs to the border if another part has a block of one of them.
void WideParts::assign_blocks(const ContactPool& pool, BlockRange range, int body_begin) {
    std::fill(touched_by_.begin(), touched_by_.end(), 0u);
    const auto moving = [&](const ContactBlock& block, auto&& visit) {
        if (block.inv_mass_a > 0) visit(block.a - body_begin);
        if (block.inv_mass_b > 0) visit(block.b - body_begin);
    };
    for (int k = range.begin; k < range.end; ++k) {
        std::uint8_t part = kMost - 1;
        moving(pool.blocks[k], [&](int i) { part = std::min(part, part_of_body_[i]); });
        part_of_block_[k - range.begin] = part;
        moving(pool.blocks[k], [&](int i) { touched_by_[i] |= 1u << part; });
    }
    for (int p = 0; p < kMost; ++p) parts_[p].neighbours = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const int part = part_of_block_[k - range.begin];
        std::uint32_t others = 0;
        moving(pool.blocks[k], [&](int i) { others |= touched_by_[i] & ~(1u << part); });
        border_[k - range.begin] = others != 0;
        parts_[part].neighbours |= others;
    }
}

// Whether the parts have few borders and are about as long. They go about in step, level by level, so the longest of each level counts.
bool WideParts::pays(const std::vector<int>& level, int levels, int blocks) {
    if (std::accumulate(border_.begin(), border_.begin() + blocks, 0) > kMostBorder * blocks) return false;
    sizes_.assign(levels * count_, 0);
    for (int k = 0; k < blocks; ++k) ++sizes_[level[k] * count_ + part_of_block_[k]];
    const auto batches = [](int size) { return (size + kLanes - 1) / kLanes; };
    double whole = 0, longest = 0;
    for (int l = 0; l < levels; ++l) {
        const int* sizes = &sizes_[l * count_];
        whole += batches(std::accumulate(sizes, sizes + count_, 0));
        longest += batches(*std::max_element(sizes, sizes + count_));
    }
    return longest <= kMostShare * whole / count_;
}

void WideParts::collect_bodies(int body_begin, int body_end) {
    for (auto& ranges : bodies_) ranges.clear();
    for (int i = 0; i < body_end - body_begin; ++i) {
        std::vector<Range>& ranges = bodies_[part_of_body_[i]];
        if (!ranges.empty() && ranges.back().end == body_begin + i)
            ++ranges.back().end;
        else
            ranges.push_back({body_begin + i, body_begin + i + 1});
    }
}

void WideParts::weigh_bodies(const ContactPool& pool, BlockRange range, int body_begin, int body_end) {
    weight_.assign(body_end - body_begin, 0);
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        if (block.inv_mass_a > 0) weight_[block.a - body_begin] += block.count;
        if (block.inv_mass_b > 0) weight_[block.b - body_begin] += block.count;
    }
}

void WideParts::divide(const ContactPool& pool, BlockRange range, const std::vector<int>& level, int levels, const SolverBodies* bodies,
                       int body_begin, int body_end, Team* team) {
    const int blocks = range.end - range.begin, n = body_end - body_begin;
    team_ = team;
    const auto be_one = [&] {
        count_ = 1;
        for (auto& ranges : bodies_) ranges.clear();
        bodies_[0].push_back({body_begin, body_end});
    };
    const int most = team == nullptr || bodies == nullptr ? 1 : std::min({team->size(), kMost, blocks / kFewestBlocks});
    if (most <= 1) return be_one();
    part_of_body_.resize(n);
    touched_by_.resize(n);
    part_of_block_.resize(blocks);
    border_.resize(blocks);
    weigh_bodies(pool, range, body_begin, body_end);
    Extent extents[3];
    for (int axis = 0; axis < 3; ++axis) {
        Extent& e = extents[axis] = {bodies->motion[body_begin].x[axis], bodies->motion[body_begin].x[axis]};
        for (int i = body_begin; i < body_end; ++i) {
            e.lo = std::min(e.lo, bodies->motion[i].x[axis]);
            e.hi = std::max(e.hi, bodies->motion[i].x[axis]);
        }
    }
    int axes[3] = {0, 1, 2};
    std::sort(axes, axes + 3, [&](int i, int k) { return extents[i].hi - extents[i].lo > extents[k].hi - extents[k].lo; });
    for (count_ = most; count_ > 1; count_ /= 2)
        for (const int axis : axes) {
            if (!cut(*bodies, axis, extents[axis], body_begin, body_end, count_)) continue;
            assign_blocks(pool, range, body_begin);
            if (pays(level, levels, blocks)) return collect_bodies(body_begin, body_end);
        }
    be_one();
}

void WideParts::begin_batches() {
    for (int p = 0; p < kMost; ++p) {
        parts_[p].segments.clear();
        parts_[p].first_batch = parts_[p].end_batch = -1;
    }
}

void WideParts::add_batches(int p, int level, bool border, int begin, int end) {
    Part& part = parts_[p];
    if (part.first_batch < 0) part.first_batch = begin;
    part.end_batch = end;
    if (count_ == 1) return;
    if (border)
        part.segments.push_back({begin, end, end, level});
    else if (part.segments.empty())
        part.segments.push_back({begin, begin, end, -1});
    else
        part.segments.back().end = end;
}

void WideParts::start(Part& part) {
    part.next = 0;
    part.most = 0;
    part.is_taken.store(false, std::memory_order_relaxed);
    part.is_done.store(false, std::memory_order_relaxed);
    part.reached.store(level_of(part, level_of(part, 0) < 0 ? 1 : 0), std::memory_order_relaxed);
}

bool WideParts::may_go_on(const Part& part, int level) const {
    for (int q = 0; q < count_; ++q)
        if ((part.neighbours >> q & 1) != 0 && parts_[q].reached.load(std::memory_order_acquire) < level) return false;
    return true;
}

// Whether one that the part waits for has nobody to go on with it.
bool WideParts::waits_for_nobody(const Part& part, int level) const {
    for (int q = 0; q < count_; ++q)
        if ((part.neighbours >> q & 1) != 0 && parts_[q].reached.load(std::memory_order_relaxed) < level &&
            !parts_[q].is_taken.load(std::memory_order_relaxed))
            return true;
    return false;
}

}  // namespace cairn
