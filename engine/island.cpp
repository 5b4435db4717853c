#include "engine/island.hpp"

#include <algorithm>

namespace cairn {

void IslandBuilder::begin(std::size_t body_count, const std::vector<std::uint32_t>& awake) {
    awake_ = &awake;
    parent_.resize(body_count);
    member_.resize(body_count);
    island_of_.resize(body_count);
    for (const std::uint32_t i : awake) {
        parent_[i] = i;
        member_[i] = 0;
    }
    for (List& list : lists_) {
        list.item.clear();
        list.body.clear();
    }
    islands_.clear();
}

std::uint32_t IslandBuilder::root(std::uint32_t body) {
    while (parent_[body] != body) {
        parent_[body] = parent_[parent_[body]];
        body = parent_[body];
    }
    return body;
}

void IslandBuilder::add(std::uint32_t body_a, std::uint32_t body_b, int kind, std::uint32_t item) {
    if (body_a == UINT32_MAX) std::swap(body_a, body_b);
    member_[body_a] = 1;
    if (body_b != UINT32_MAX) {
        member_[body_b] = 1;
        const std::uint32_t a = root(body_a), b = root(body_b);
        // The lower index is the root, so the result does not depend on the order of the calls.
        if (a < b) parent_[b] = a;
        if (b < a) parent_[a] = b;
    }
    lists_[kind].item.push_back(item);
    lists_[kind].body.push_back(body_a);
}

void IslandBuilder::finish() {
    for (const std::uint32_t i : *awake_) {
        if (!member_[i]) continue;
        const std::uint32_t r = root(i);
        if (r == i) {  // the root is the lowest, so it comes first
            island_of_[i] = count();
            islands_.emplace_back();
        }
        island_of_[i] = island_of_[r];
        ++islands_[island_of_[i]].bodies.end;
    }
    for (int kind = 0; kind < 2; ++kind)
        for (std::uint32_t body : lists_[kind].body) ++islands_[island_of_[body]].items[kind].end;
    // Counts to ranges; `end` then runs up again as the lists are filled.
    int body_total = 0, item_total[2] = {0, 0};
    for (Island& island : islands_) {
        const auto place = [](IndexRange& r, int& total) {
            const int size = r.end;
            r.begin = r.end = total;
            total += size;
        };
        place(island.bodies, body_total);
        for (int kind = 0; kind < 2; ++kind) place(island.items[kind], item_total[kind]);
    }
    body_list_.resize(body_total);
    for (const std::uint32_t i : *awake_)
        if (member_[i]) body_list_[islands_[island_of_[i]].bodies.end++] = i;
    for (int kind = 0; kind < 2; ++kind) {
        List& list = lists_[kind];
        list.sorted.resize(item_total[kind]);
        for (std::size_t k = 0; k < list.item.size(); ++k) list.sorted[islands_[island_of_[list.body[k]]].items[kind].end++] = list.item[k];
    }
}

}  // namespace cairn
