#include "collision/dynamic_tree.hpp"

#include "collision/box_splitter.hpp"

#include <algorithm>
#include <numeric>

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

int DynamicTree::insert(const Aabb& box, std::int32_t item) {
    flat_.clear();
    const int leaf = allocate();
    nodes_[leaf].box = box;
    nodes_[leaf].child = {-1, item};
    attach(leaf);
    ++size_;
    return leaf;
}

void DynamicTree::remove(int leaf) {
    flat_.clear();
    detach(leaf);
    release(leaf);
    --size_;
}

void DynamicTree::set_box(int leaf, const Aabb& box) {
    flat_.clear();
    nodes_[leaf].box = box;
    for (int node = nodes_[leaf].parent; node >= 0 && !nodes_[node].box.contains(box); node = nodes_[node].parent)
        nodes_[node].box = nodes_[node].box.merged(box);
}

void DynamicTree::reinsert(int leaf) {
    flat_.clear();
    detach(leaf);
    attach(leaf);
}

// Where a new leaf costs least: at each node, either it becomes the node's sibling or it goes down the cheaper child. Costs are half areas:
// of the new parent, which is at least that of the box, plus what the nodes on the way grow by. Equal costs (boxes at one place) go down
// the lower side.
int DynamicTree::best_sibling(const Aabb& box) const {
    const Real own = box.half_area();
    int at = root_;
    while (!nodes_[at].is_leaf()) {
        const Real joined = nodes_[at].box.merged(box).half_area();
        const Real growth = joined - nodes_[at].box.half_area();
        std::array<Real, 2> below;
        for (int k = 0; k < 2; ++k) {
            const Node& child = nodes_[nodes_[at].child[k]];
            below[k] = growth + child.box.merged(box).half_area() + (child.is_leaf() ? 0 : own - child.box.half_area());
        }
        if (joined < std::min(below[0], below[1])) break;
        const auto& [a, b] = nodes_[at].child;
        const bool second = below[0] != below[1] ? below[1] < below[0] : nodes_[b].height < nodes_[a].height;
        at = second ? b : a;
    }
    return at;
}

void DynamicTree::attach(int leaf) {
    nodes_[leaf].parent = -1;
    if (root_ < 0) {
        root_ = leaf;
        return;
    }
    const int sibling = best_sibling(nodes_[leaf].box);
    const int parent = allocate();
    replace_child(nodes_[sibling].parent, sibling, parent);
    nodes_[parent].child = {sibling, leaf};
    nodes_[sibling].parent = nodes_[leaf].parent = parent;
    refit_upwards(parent);
}

void DynamicTree::detach(int leaf) {
    const int parent = nodes_[leaf].parent;
    if (parent < 0) {
        root_ = -1;
        return;
    }
    const int sibling = nodes_[parent].child[nodes_[parent].child[0] == leaf ? 1 : 0];
    replace_child(nodes_[parent].parent, parent, sibling);
    refit_upwards(nodes_[parent].parent);
    release(parent);
}

void DynamicTree::replace_child(int parent, int old_child, int new_child) {
    nodes_[new_child].parent = parent;
    if (parent < 0)
        root_ = new_child;
    else
        nodes_[parent].child[nodes_[parent].child[0] == old_child ? 0 : 1] = new_child;
}

void DynamicTree::refit(int node) {
    Node& n = nodes_[node];
    const Node &a = nodes_[n.child[0]], &b = nodes_[n.child[1]];
    n.box = a.box.merged(b.box);
    n.height = 1 + std::max(a.height, b.height);
}

// Ends where nothing has changed on two levels: a trade looks at grandchildren, so nothing farther up can see the change below.
void DynamicTree::refit_upwards(int node) {
    for (int unchanged = 0; node >= 0 && unchanged < 2; node = nodes_[node].parent) {
        const Aabb box = nodes_[node].box;
        const int height = nodes_[node].height;
        const bool traded = rotate(node);
        refit(node);
        const bool same = !traded && height == nodes_[node].height && box.lo == nodes_[node].box.lo && box.hi == nodes_[node].box.hi;
        unchanged = same ? unchanged + 1 : 0;
    }
}

// Trades a child of the node for a child of its sibling, whichever of the four trades shrinks the sibling's box most; none (false) if
// none does.
bool DynamicTree::rotate(int node) {
    Real best_saving = 0;
    int best_up = -1, best_down = -1;  // the grandchild that rises and the child that sinks in its stead
    for (int k = 0; k < 2; ++k) {
        const int down = nodes_[node].child[k];
        const Node& sibling = nodes_[nodes_[node].child[1 - k]];
        if (sibling.is_leaf()) continue;
        const Real area = sibling.box.half_area();
        for (int j = 0; j < 2; ++j) {
            const Real saving = area - nodes_[sibling.child[1 - j]].box.merged(nodes_[down].box).half_area();
            if (saving <= best_saving) continue;
            best_saving = saving;
            best_up = sibling.child[j];
            best_down = down;
        }
    }
    if (best_up < 0) return false;
    const int sibling = nodes_[best_up].parent;
    replace_child(sibling, best_up, best_down);
    replace_child(node, best_down, best_up);
    refit(sibling);
    return true;
}

// All leaves and all inner nodes, ascending.
void DynamicTree::collect() {
    leaves_.clear();
    inner_.clear();
    order_.clear();
    if (root_ >= 0) order_.push_back(root_);
    while (!order_.empty()) {
        const int node = order_.back();
        order_.pop_back();
        if (nodes_[node].is_leaf()) {
            leaves_.push_back(node);
        } else {
            inner_.push_back(node);
            order_.insert(order_.end(), nodes_[node].child.begin(), nodes_[node].child.end());
        }
    }
    std::sort(leaves_.begin(), leaves_.end());
    std::sort(inner_.begin(), inner_.end());
}

bool DynamicTree::refit_all() {
    if (size_ < 3) return true;
    // Depth first, as rebuild lays the nodes out in memory.
    leaves_.assign(1, root_);
    order_.clear();
    while (!leaves_.empty()) {
        const int node = leaves_.back();
        leaves_.pop_back();
        order_.push_back(node);
        for (int k = 1; k >= 0; --k)
            if (const int child = nodes_[node].child[k]; !nodes_[child].is_leaf()) leaves_.push_back(child);
    }
    constexpr Real kWorn = 1.4;
    return refit_in_order(order_) <= kWorn * built_cost_;
}

Real DynamicTree::refit_in_order(const std::vector<int>& inner_nodes) {
    Real inner = 0, leaves = 0;
    place_.resize(nodes_.size());
    for (std::size_t k = 0; k < inner_nodes.size(); ++k) place_[inner_nodes[k]] = static_cast<int>(k);
    flat_.resize(inner_nodes.size());
    for (std::size_t k = inner_nodes.size(); k-- > 0;) {  // children come after their parents
        const int node = inner_nodes[k];
        refit(node);
        inner += nodes_[node].box.half_area();
        for (int side = 0; side < 2; ++side) {
            const int index = nodes_[node].child[side];
            const Node& child = nodes_[index];
            if (child.is_leaf()) leaves += child.box.half_area();
            flat_.set_child(k, side, child.box, child.is_leaf() ? -1 - index : place_[index]);
        }
    }
    return leaves > 0 ? inner / leaves : 0;
}

// From the top down by the surface area heuristic. Leaves keep their handles; inner nodes are dealt out again, parents before their
// children, so that neighbours in the tree are neighbours in memory.
void DynamicTree::rebuild() {
    collect();
    if (leaves_.size() < 3) return;
    boxes_.clear();
    for (const int leaf : leaves_) boxes_.push_back(nodes_[leaf].box);
    order_.resize(leaves_.size());
    std::iota(order_.begin(), order_.end(), 0);

    const BoxSplitter splitter(boxes_);
    std::size_t used = 0;
    root_ = -1;
    tasks_.assign(1, {0, static_cast<int>(leaves_.size()), 0, -1});
    while (!tasks_.empty()) {
        const Task task = tasks_.back();
        tasks_.pop_back();
        const bool is_leaf = task.last - task.first == 1;
        const int node = is_leaf ? leaves_[order_[task.first]] : inner_[used++];
        nodes_[node].parent = task.parent;
        if (task.parent < 0)
            root_ = node;
        else
            nodes_[task.parent].child[nodes_[task.parent].child[0] < 0 ? 0 : 1] = node;
        if (is_leaf) continue;

        nodes_[node].child = {-1, -1};
        int* const order = order_.data();
        const int middle = static_cast<int>(splitter.split(order + task.first, order + task.last, task.depth) - order);
        tasks_.push_back({middle, task.last, task.depth + 1, node});
        tasks_.push_back({task.first, middle, task.depth + 1, node});
    }
    built_cost_ = refit_in_order(inner_);
}

}  // namespace cairn
