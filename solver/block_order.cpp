#include "solver/block_order.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace cairn {
namespace {

constexpr int kFewestBlocks = 12;  // less is not worth it
constexpr int kFewestAtOnce = 2;   // blocks side by side, on average: less is a chain
constexpr int kLargestDepth = 24;  // of what is farther away, or held by nothing
constexpr int kColours = 64;       // the last one is for all that would need more

}  // namespace

int find_levels(std::span<const ContactBlock> blocks, int body_begin, std::vector<int>& next, std::vector<int>& level) {
    std::fill(next.begin(), next.end(), 0);
    if (level.size() < blocks.size()) level.resize(blocks.size());
    int levels = 0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const ContactBlock& block = blocks[k];
        int at = 0;
        if (block.inv_mass_a > 0) at = next[block.a - body_begin];
        if (block.inv_mass_b > 0) at = std::max(at, next[block.b - body_begin]);
        level[k] = at;
        if (block.inv_mass_a > 0) next[block.a - body_begin] = at + 1;
        if (block.inv_mass_b > 0) next[block.b - body_begin] = at + 1;
        levels = std::max(levels, at + 1);
    }
    return levels;
}

bool is_shallow(std::span<const ContactBlock> blocks, int body_begin, int body_end, int most, std::vector<int>& depth) {
    depth.assign(body_end - body_begin, most + 1);
    int deeper = body_end - body_begin;  // bodies that are
    const auto depth_of = [&](int body, Real inv_mass) { return inv_mass > 0 ? depth[body - body_begin] : 0; };
    const auto lower = [&](int body, int to) {
        int& at = depth[body - body_begin];
        if (to >= at) return;
        if (at > most) --deeper;
        at = to;
    };
    for (int pass = 0; pass < most && deeper > 0; ++pass) {  // each settles one more depth at least
        for (const ContactBlock& block : blocks) {
            if (block.inv_mass_a > 0) lower(block.a, depth_of(block.b, block.inv_mass_b) + 1);
            if (block.inv_mass_b > 0) lower(block.b, depth_of(block.a, block.inv_mass_a) + 1);
        }
    }
    return deeper == 0;
}

bool BlockOrder::is_chain(std::span<const ContactBlock> blocks) {
    return find_levels(blocks, body_begin_, next_, level_) * kFewestAtOnce > static_cast<int>(blocks.size());
}

void BlockOrder::find_depths(const ContactPool& pool, BlockRange range) {
    std::fill(depth_.begin(), depth_.end(), kLargestDepth);
    bool is_settled = false;
    const auto lower = [&](int body, int depth) {
        if (depth >= depth_[body - body_begin_]) return;
        depth_[body - body_begin_] = depth;
        is_settled = false;
    };
    while (!is_settled) {  // a pass settles one more depth at least
        is_settled = true;
        for (int k = range.begin; k < range.end; ++k) {
            const ContactBlock& block = pool.blocks[k];
            if (block.inv_mass_a > 0) lower(block.a, depth_of(block.b, block.inv_mass_b) + 1);
            if (block.inv_mass_b > 0) lower(block.b, depth_of(block.a, block.inv_mass_a) + 1);
        }
    }
}

void BlockOrder::find_places(const ContactPool& pool, BlockRange range) {
    std::fill(colours_.begin(), colours_.end(), 0);
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        const int a = depth_of(block.a, block.inv_mass_a), b = depth_of(block.b, block.inv_mass_b);
        int colour = 0;
        if (a == b) {
            std::uint64_t &of_a = colours_[block.a - body_begin_], &of_b = colours_[block.b - body_begin_];
            colour = std::min(std::countr_one(of_a | of_b), kColours - 1);
            of_a |= std::uint64_t{1} << colour;
            of_b |= std::uint64_t{1} << colour;
        }
        place_[k - range.begin] = (a + b) * kColours + colour;
    }
}

bool BlockOrder::spread(ContactPool& pool, BlockRange range, int body_begin, int body_end) {
    const int count = range.end - range.begin;
    if (count < kFewestBlocks) return false;
    body_begin_ = body_begin;
    next_.resize(body_end - body_begin);
    const std::span<ContactBlock> blocks(pool.blocks.data() + range.begin, count);
    if (!is_chain(blocks)) return false;
    depth_.resize(next_.size());
    colours_.resize(next_.size());
    place_.resize(count);
    find_depths(pool, range);
    find_places(pool, range);
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(), [&](int k, int l) { return place_[k] != place_[l] ? place_[k] < place_[l] : k < l; });
    blocks_.clear();
    for (const int k : order_) blocks_.push_back(blocks[k]);
    if (is_chain(blocks_)) return false;
    std::copy(blocks_.begin(), blocks_.end(), blocks.begin());
    return true;
}

}  // namespace cairn
