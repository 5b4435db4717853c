// Which edges (contacts or joints) hang on a body: two-sided lists through the edges themselves, so that a body's edges are found without
// passing over the others. An end may be kNoEnd (the world). Allocates only to grow beyond the largest edge and body so far.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cairn {

class Links {
public:
    static constexpr std::uint32_t kNoEnd = UINT32_MAX;

    // Links edge number `edge`, which must not be linked, to two bodies that differ.
    void add(std::uint32_t edge, std::uint32_t body_a, std::uint32_t body_b) {
        if (edges_.size() <= edge) edges_.resize(edge + 1);
        edges_[edge].body = {body_a, body_b};
        for (int side = 0; side < 2; ++side) {
            const std::uint32_t body = edges_[edge].body[side];
            if (body == kNoEnd) continue;
            if (heads_.size() <= body) heads_.resize(body + 1, kNoEnd);
            std::uint32_t& head = heads_[body];
            edges_[edge].prev[side] = kNoEnd;
            edges_[edge].next[side] = head;
            if (head != kNoEnd) edges_[head].prev[side_of(head, body)] = edge;
            head = edge;
        }
    }

    // Does nothing if the edge is not linked.
    void remove(std::uint32_t edge) {
        if (!contains(edge)) return;
        const Edge e = edges_[edge];
        for (int side = 0; side < 2; ++side) {
            const std::uint32_t body = e.body[side], prev = e.prev[side], next = e.next[side];
            if (body == kNoEnd) continue;
            if (prev == kNoEnd)
                heads_[body] = next;
            else
                edges_[prev].next[side_of(prev, body)] = next;
            if (next != kNoEnd) edges_[next].prev[side_of(next, body)] = prev;
        }
        edges_[edge] = Edge();
    }

    bool contains(std::uint32_t edge) const {
        return edge < edges_.size() && (edges_[edge].body[0] != kNoEnd || edges_[edge].body[1] != kNoEnd);
    }
    bool has_any(std::uint32_t body) const { return body < heads_.size() && heads_[body] != kNoEnd; }
    // The bodies of a linked edge.
    const std::array<std::uint32_t, 2>& bodies(std::uint32_t edge) const { return edges_[edge].body; }

    // Calls visit(edge, other body) for each edge of the body, the last one added first; visit may remove the edge it is given.
    template <class Visit>
    void for_each(std::uint32_t body, Visit&& visit) const {
        if (body >= heads_.size()) return;
        for (std::uint32_t edge = heads_[body]; edge != kNoEnd;) {
            const int side = side_of(edge, body);
            const std::uint32_t next = edges_[edge].next[side];
            visit(edge, edges_[edge].body[1 - side]);
            edge = next;
        }
    }

private:
    struct Edge {
        std::array<std::uint32_t, 2> body{kNoEnd, kNoEnd};
        std::array<std::uint32_t, 2> prev{kNoEnd, kNoEnd};  // in the list of body[0] and in that of body[1]
        std::array<std::uint32_t, 2> next{kNoEnd, kNoEnd};
    };
    int side_of(std::uint32_t edge, std::uint32_t body) const { return edges_[edge].body[0] == body ? 0 : 1; }

    std::vector<Edge> edges_;
    std::vector<std::uint32_t> heads_;  // per body
};

}  // namespace cairn
