// The overlapping pairs of a broad phase, each linked into the lists of its two proxies. Internal to the broad phase.
#pragma once

#include "collision/broad_phase.hpp"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace cairn {

// Pairs live in a pool; links are indices into it, −1 ends a list. Allocates only to grow beyond the largest number of pairs so far.
class PairList {
public:
    void add_proxy() { head_.push_back(-1); }

    void add(const ProxyPair& pair) {
        const int index = allocate();
        pairs_[index].id = {pair.a, pair.b};
        for (int side = 0; side < 2; ++side) {
            std::int32_t& head = head_[pairs_[index].id[side]];
            pairs_[index].prev[side] = -1;
            pairs_[index].next[side] = head;
            if (head >= 0) pairs_[head].prev[pairs_[head].side(pairs_[index].id[side])] = index;
            head = index;
        }
        ++count_;
    }

    // Calls keep(partner) for each pair of the proxy; those it says false to are taken out and appended to `ended`.
    template <class Keep>
    void filter(ProxyId proxy, Keep&& keep, std::vector<ProxyPair>& ended) {
        for (int index = head_[proxy]; index >= 0;) {
            const Pair& pair = pairs_[index];
            const int side = pair.side(proxy);
            const int next = pair.next[side];
            if (!keep(pair.id[1 - side])) {
                ended.push_back({pair.id[0], pair.id[1]});
                remove(index);
            }
            index = next;
        }
    }

    bool is_alone(ProxyId proxy) const { return head_[proxy] < 0; }
    std::size_t count() const { return count_; }

private:
    struct Pair {
        std::array<ProxyId, 2> id{kNoProxy, kNoProxy};
        std::array<std::int32_t, 2> prev{-1, -1};  // in the list of id[0] and in that of id[1]
        std::array<std::int32_t, 2> next{-1, -1};
        int side(ProxyId proxy) const { return id[0] == proxy ? 0 : 1; }
    };

    int allocate() {
        if (free_ < 0) {
            pairs_.emplace_back();
            return static_cast<int>(pairs_.size()) - 1;
        }
        return std::exchange(free_, pairs_[free_].next[0]);
    }

    void remove(int index) {
        const Pair pair = pairs_[index];
        for (int side = 0; side < 2; ++side) {
            const ProxyId proxy = pair.id[side];
            const int prev = pair.prev[side], next = pair.next[side];
            if (prev >= 0)
                pairs_[prev].next[pairs_[prev].side(proxy)] = next;
            else
                head_[proxy] = next;
            if (next >= 0) pairs_[next].prev[pairs_[next].side(proxy)] = prev;
        }
        pairs_[index].next[0] = free_;
        free_ = index;
        --count_;
    }

    std::vector<Pair> pairs_;
    std::vector<std::int32_t> head_;  // per proxy
    std::int32_t free_ = -1;
    std::size_t count_ = 0;
};

}  // namespace cairn
