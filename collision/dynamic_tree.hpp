// A bounding volume hierarchy over boxes that come, go and move. Internal to the broad phase.
//
// A binary tree: boxes at the leaves, a node's box holds those of its children. A new leaf goes where it adds least surface area on the way
// down (Goldsmith & Salmon 1987); on the way back up a node trades one child for a grandchild on the other side where that saves area
// (Kensler 2008). When most leaves have moved, building the tree anew is both cheaper and better. After that, and after refit_all, queries
// go through a flat copy, until the tree changes.
#pragma once

#include "collision/aabb.hpp"
#include "collision/flat_tree.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace cairn {

class DynamicTree {
public:
    // Returns the leaf's handle. Allocates, like rebuild, only when the tree grows beyond its largest size so far.
    int insert(const Aabb& box, std::int32_t item);
    void remove(int leaf);
    // Gives the leaf a new box where it is. Queries stay right but slow down, until reinsert(leaf) or rebuild().
    void set_box(int leaf, const Aabb& box);
    // The same for a box inside the one that it had.
    void shrink_box(int leaf, const Aabb& box) { nodes_[leaf].box = box; }
    // Moves the leaf to where its box fits best.
    void reinsert(int leaf);
    void rebuild();
    // After many set_box: fits every box to its children where they are. False if that leaves the tree much worse than when it was built.
    bool refit_all();

    std::size_t size() const { return size_; }
    int height() const { return root_ < 0 ? 0 : nodes_[root_].height; }

    // Calls visit(item) for every leaf whose box overlaps `box`; the order depends on the tree's history. Never allocates. May be called by
    // several threads at once.
    template <class Visit>
    void query(const Aabb& box, Visit&& visit) const {
        const auto visit_leaf = [&](int leaf) {
            if (nodes_[leaf].box.overlaps(box)) visit(nodes_[leaf].item());
        };
        if (!flat_.empty()) return flat_.query(box, visit_leaf);
        if (root_ >= 0) query_below(root_, box, visit);
    }

private:
    struct Node {
        Aabb box;
        std::int32_t parent = -1;                   // of a free node: the next free one
        std::array<std::int32_t, 2> child{-1, -1};  // leaf: −1 and its item
        std::int32_t height = 0;
        bool is_leaf() const { return child[0] < 0; }
        std::int32_t item() const { return child[1]; }
    };

    template <class Visit>
    void query_below(int top, const Aabb& box, Visit& visit) const {
        constexpr int kStackSize = 128;
        std::array<int, kStackSize> stack;
        int size = 0;
        stack[size++] = top;
        while (size > 0) {
            const Node& node = nodes_[stack[--size]];
            if (!node.box.overlaps(box)) continue;
            if (node.is_leaf()) {
                visit(node.item());
            } else if (size + 2 <= kStackSize) {
                stack[size++] = node.child[1];
                stack[size++] = node.child[0];
            } else {  // boxes nested in each other a hundredfold
                query_below(node.child[0], box, visit);
                query_below(node.child[1], box, visit);
            }
        }
    }

    int allocate();
    void release(int node);
    int best_sibling(const Aabb& box) const;
    void attach(int leaf);
    void detach(int leaf);
    void replace_child(int parent, int old_child, int new_child);
    void refit(int node);
    void refit_upwards(int node);
    bool rotate(int node);
    void collect();
    // Inner nodes, parents before their children. Returns what a query has to look at: their areas over those of the leaves.
    Real refit_in_order(const std::vector<int>& inner_nodes);

    std::vector<Node> nodes_;
    int root_ = -1;
    int free_ = -1;
    Real built_cost_ = 0;   // of refit_in_order when it was last built
    std::size_t size_ = 0;  // leaves
    FlatTree flat_;         // empty: the tree has changed

    // Scratch of rebuild.
    struct Task {
        int first, last, depth, parent;
    };
    std::vector<int> leaves_, inner_, order_, place_;
    std::vector<Aabb> boxes_;
    std::vector<Task> tasks_;
};

}  // namespace cairn
