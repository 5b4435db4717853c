#include "collision/mesh_tree.hpp"

#include "collision/box_splitter.hpp"

#include <numeric>

namespace cairn {

void MeshTree::add_leaf(const std::vector<Aabb>& boxes, const int* first, const int* last) {
    Leaf& leaf = leaves_.emplace_back();
    for (int k = 0; k < 3; ++k) leaf.lo[k] = leaf.hi[k] = Four{};
    for (const int* t = first; t != last; ++t) {
        const int i = leaf.count++;
        leaf.triangle[static_cast<std::size_t>(i)] = *t;
        for (int k = 0; k < 3; ++k) {
            leaf.lo[k][i] = below(boxes[static_cast<std::size_t>(*t)].lo[k]);
            leaf.hi[k][i] = -below(-boxes[static_cast<std::size_t>(*t)].hi[k]);
        }
    }
}

MeshTree::MeshTree(const std::vector<Aabb>& boxes) {
    const BoxSplitter splitter(boxes);
    std::vector<int> order(boxes.size());
    std::iota(order.begin(), order.end(), 0);

    // Depth first; a parent learns of a child when that is reached.
    struct Task {
        int *first, *last;
        int depth, parent, side;
    };
    struct Child {
        int parent, side;
        Aabb box;
        std::int32_t index;
    };
    std::vector<Child> children;
    std::size_t inner = 0;
    std::vector<Task> tasks{{order.data(), order.data() + order.size(), 0, -1, 0}};
    while (!tasks.empty()) {
        const Task task = tasks.back();
        tasks.pop_back();
        const bool is_leaf = task.last - task.first <= kLeafSize;
        const std::int32_t index = static_cast<std::int32_t>(is_leaf ? leaves_.size() : inner);
        if (task.parent >= 0)
            children.push_back({task.parent, task.side, splitter.bounds(task.first, task.last), is_leaf ? -1 - index : index});
        if (is_leaf) {
            add_leaf(boxes, task.first, task.last);
            continue;
        }
        ++inner;
        int* const middle = splitter.split(task.first, task.last, task.depth);
        tasks.push_back({middle, task.last, task.depth + 1, index, 1});
        tasks.push_back({task.first, middle, task.depth + 1, index, 0});
    }
    inner_.resize(inner);
    for (const Child& c : children) inner_.set_child(static_cast<std::size_t>(c.parent), c.side, c.box, c.index);
}

}  // namespace cairn
