#include "collision/dynamic_tree.hpp"

#include <algorithm>
#include <utility>

namespace cairn {

int DynamicTree::allocate() {
    if (free_ < 0) {
        nodes_.emplace_back();
        return static_cast<int>(nodes_.size()) - 1;
    }
    const int node = free_;
    free_ = nodes_[node].parent;
    nodes_[node] = Node();
    return node;
}

void DynamicTree::release(int node) {
    nodes_[node].parent = free_;
    free_ = node;
}

// Where a new leaf costs least: at each node, either it becomes the node's sibling or it goes down the cheaper child. Costs are half areas:
// of the new parent, plus what all ancestors grow by.
int DynamicTree::best_sibling(const Aabb& box) const {
    int at = root_;
    while (!nodes_[at].is_leaf()) {
        const Real joined = nodes_[at].box.merged(box).half_area();
        const Real growth = joined - nodes_[at].box.half_area();
        std::array<Real, 2> below;
        for (int k = 0; k < 2; ++k) {
            const Node& child = nodes_[nodes_[at].child[k]];
            below[k] = growth + child.box.merged(box).half_area() - (child.is_leaf() ? 0 : child.box.half_area());
        }
        if (joined < std::min(below[0], below[1])) break;
        at = nodes_[at].child[below[1] < below[0] ? 1 : 0];
    }
    return at;
}

int DynamicTree::insert(const Aabb& box, std::int32_t item) {
    const int leaf = allocate();
    nodes_[leaf].box = box;
    nodes_[leaf].child = {-1, item};
    if (root_ < 0) return root_ = leaf;

    const int sibling = best_sibling(box);
    const int parent = allocate();
    replace_child(nodes_[sibling].parent, sibling, parent);
    nodes_[parent].child = {sibling, leaf};
    nodes_[sibling].parent = nodes_[leaf].parent = parent;
    refit(parent);
    repair_upwards(nodes_[parent].parent);
    return leaf;
}

void DynamicTree::remove(int leaf) {
    const int parent = nodes_[leaf].parent;
    if (parent < 0) {
        root_ = -1;
    } else {
        const int sibling = nodes_[parent].child[nodes_[parent].child[0] == leaf ? 1 : 0];
        replace_child(nodes_[parent].parent, parent, sibling);
        repair_upwards(nodes_[parent].parent);
        release(parent);
    }
    release(leaf);
}

void DynamicTree::replace_child(int parent, int old_child, int new_child) {
    nodes_[new_child].parent = parent;
    if (parent < 0)
        root_ = new_child;
    else
        nodes_[parent].child[nodes_[parent].child[0] == old_child ? 0 : 1] = new_child;
}

// Box and height from the children; false if neither changed.
bool DynamicTree::refit(int node) {
    Node& n = nodes_[node];
    const Node &a = nodes_[n.child[0]], &b = nodes_[n.child[1]];
    const Aabb box = a.box.merged(b.box);
    const int height = 1 + std::max(a.height, b.height);
    if (height == n.height && box.lo == n.box.lo && box.hi == n.box.hi) return false;
    n.box = box;
    n.height = height;
    return true;
}

void DynamicTree::repair_upwards(int node) {
    while (node >= 0) {
        const int top = balance(node);
        if (!refit(top) && top == node) return;  // nothing above can have changed
        node = nodes_[top].parent;
    }
}

// If one child is two levels higher than the other, it takes its parent's place and hands down its own lower child. Returns the new top.
int DynamicTree::balance(int node) {
    const std::array<std::int32_t, 2> child = nodes_[node].child;
    const int lean = nodes_[child[1]].height - nodes_[child[0]].height;
    if (std::abs(lean) <= 1) return node;

    const int tall = child[lean > 0 ? 1 : 0];
    const int low = child[lean > 0 ? 0 : 1];
    auto [keep, give] = nodes_[tall].child;
    const Aabb& beside = nodes_[low].box;
    const bool tie = nodes_[keep].height == nodes_[give].height;
    const bool swap_by_area = tie && beside.merged(nodes_[keep].box).half_area() < beside.merged(nodes_[give].box).half_area();
    if (nodes_[keep].height < nodes_[give].height || swap_by_area) std::swap(keep, give);

    replace_child(nodes_[node].parent, node, tall);
    nodes_[tall].child = {node, keep};
    nodes_[node].child = {low, give};
    nodes_[node].parent = tall;
    nodes_[give].parent = node;
    refit(node);
    refit(tall);
    return tall;
}

}  // namespace cairn
