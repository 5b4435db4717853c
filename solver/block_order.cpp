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

// Blocks on the longest way through what waits for what, in the order of `order_`.
int BlockOrder::chain_length(const ContactPool& pool, BlockRange range) {
    std::fill(next_.begin(), next_.end(), 0);
    int length = 0;
    for (const int k : order_) {
        const ContactBlock& block = pool.blocks[range.begin + k];
        int at = 0;
        if (block.inv_mass_a > 0) at = next_[block.a - body_begin_];
        if (block.inv_mass_b > 0) at = std::max(at, next_[block.b - body_begin_]);
        if (block.inv_mass_a > 0) next_[block.a - body_begin_] = at + 1;
        if (block.inv_mass_b > 0) next_[block.b - body_begin_] = at + 1;
        length = std::max(length, at + 1);
    }
    return length;
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
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0);
    if (chain_length(pool, range) * kFewestAtOnce <= count) return false;
    depth_.resize(next_.size());
    colours_.resize(next_.size());
    place_.resize(count);
    find_depths(pool, range);
    find_places(pool, range);
    std::sort(order_.begin(), order_.end(), [&](int k, int l) { return place_[k] != place_[l] ? place_[k] < place_[l] : k < l; });
    if (chain_length(pool, range) * kFewestAtOnce > count) return false;
    blocks_.assign(pool.blocks.begin() + range.begin, pool.blocks.begin() + range.end);
    for (int k = 0; k < count; ++k) pool.blocks[range.begin + k] = blocks_[order_[k]];
    return true;
}

}  // namespace cairn
