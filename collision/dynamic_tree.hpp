// A bounding volume hierarchy over boxes that come, go and move. Internal to the broad phase.
//
// A binary tree: boxes at the leaves, a node's box holds those of its children. A new leaf goes where it adds least surface area on the way
// down (Goldsmith & Salmon 1987); rotations keep the heights of siblings within one of each other (Adelson-Velsky & Landis 1962; the order
// of children means nothing here, so one rotation always does), so a tree of n leaves is at most 1.44 log₂ n + 2 high and a query needs no
// heap.
#pragma once

#include "collision/aabb.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace cairn {

class DynamicTree {
public:
    // Returns the leaf's handle. Allocates only when the tree grows beyond its largest size so far.
    int insert(const Aabb& box, std::int32_t item);
    void remove(int leaf);

    // Calls visit(item) for every leaf whose box overlaps `box`; the order depends on the tree's history.
    template <class Visit>
    void query(const Aabb& box, Visit&& visit) const {
        if (root_ < 0) return;
        std::array<int, kStackSize> stack;
        int size = 0;
        stack[size++] = root_;
        while (size > 0) {
            const Node& node = nodes_[stack[--size]];
            if (!node.box.overlaps(box)) continue;
            if (node.is_leaf()) {
                visit(node.item());
            } else {
                stack[size++] = node.child[1];
                stack[size++] = node.child[0];
            }
        }
    }

    int height() const { return root_ < 0 ? 0 : nodes_[root_].height; }

private:
    static constexpr int kStackSize = 64;  // 1.44 · 31 + 2 < 64

    struct Node {
        Aabb box;
        std::int32_t parent = -1;                   // of a free node: the next free one
        std::array<std::int32_t, 2> child{-1, -1};  // leaf: −1 and its item
        std::int32_t height = 0;
        bool is_leaf() const { return child[0] < 0; }
        std::int32_t item() const { return child[1]; }
    };

    int allocate();
    void release(int node);
    int best_sibling(const Aabb& box) const;
    void replace_child(int parent, int old_child, int new_child);
    bool refit(int node);
    void repair_upwards(int node);
    int balance(int node);

    std::vector<Node> nodes_;
    int root_ = -1;
    int free_ = -1;
};

}  // namespace cairn
