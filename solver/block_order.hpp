// An order of sweeping in which more contacts of an island can be swept side by side (solver/wide_contacts.hpp).
//
// What a sweep visits first is waited for. Where the order in which contacts were found makes nearly every block wait for the one before it
// (dominoes in a row, bricks in a line), blocks are ordered by how many contacts their bodies are away from what does not move: from the
// ground up, as loads are carried. Blocks of the same distance on both sides hold each other sideways and carry no load on, so they may
// take any order: each gets the first of some colours that no other such block of its bodies has. A stack stays the chain that it is, in
// the order that holds it up.
#pragma once

#include "solver/contact_rows.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace cairn {

// What waits for what: a block's level is one above the highest level of an earlier block that shares a dynamic body with it. Returns the
// number of levels, the length of the longest chain. `level`: of each block. `next`: scratch, of each body from body_begin on, the first
// level that may touch it again; sized by the caller.
int find_levels(std::span<const ContactBlock> blocks, int body_begin, std::vector<int>& next, std::vector<int>& level);

// Whether every one of the dynamic bodies [body_begin, body_end) is at most `most` contacts away from what does not move. `depth`: scratch.
bool is_shallow(std::span<const ContactBlock> blocks, int body_begin, int body_end, int most, std::vector<int>& depth);

class BlockOrder {
public:
    // Reorders the blocks of `range`, whose dynamic bodies are those of [body_begin, body_end), if they are a chain as they stand and would
    // be none then. True: source(k) tells where block range.begin + k was, from range.begin on; points stay where they are, so that
    // points_of() no longer holds. Keeps its memory.
    bool spread(ContactPool& pool, BlockRange range, int body_begin, int body_end);
    int source(int k) const { return order_[k]; }

private:
    int depth_of(int body, Real inv_mass) const { return inv_mass > 0 ? depth_[body - body_begin_] : 0; }
    bool is_chain(std::span<const ContactBlock> blocks);
    void find_depths(const ContactPool& pool, BlockRange range);
    void find_places(const ContactPool& pool, BlockRange range);

    int body_begin_ = 0;
    std::vector<int> order_;
    std::vector<int> next_, level_;       // find_levels()
    std::vector<int> depth_;              // of a body: contacts between it and what does not move
    std::vector<int> place_;              // of a block: by distance, then by colour
    std::vector<std::uint64_t> colours_;  // of a body that its blocks have
    std::vector<ContactBlock> blocks_;
};

}  // namespace cairn
