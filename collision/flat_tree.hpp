// A bounding volume tree as it is at one moment, laid out for many queries. Internal to the broad phase and to meshes.
//
// A node holds the boxes of both of its children in single precision, rounded outwards, in one line of the cache; nodes lie depth first. So
// a query looks at inner nodes alone, one line each, and finds every box that it should and now and then one that misses by rounding.
#pragma once

#include "collision/aabb.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace cairn {

class FlatTree {
public:
    void clear() { nodes_.clear(); }
    bool empty() const { return nodes_.empty(); }
    // For so many inner nodes; the first is the root.
    void resize(std::size_t inner_nodes) { nodes_.resize(inner_nodes); }
    // `child`: an inner node, or for a leaf −1 − what tells it.
    void set_child(std::size_t node, int side, const Aabb& box, std::int32_t child);

    // The greatest float that is surely at most x; −∞ where there is none.
    static float rounded_down(Real x);

    // Calls visit(leaf) for every leaf whose box overlaps `box`, and for some that miss it by less than single precision tells.
    template <class Visit>
    void query(const Aabb& box, Visit&& visit) const {
        if (!nodes_.empty()) query_below(0, asked(box), visit);
    }

private:
    // Four floats and what comparing them gives, by GCC's and Clang's vector types.
    typedef float Four __attribute__((vector_size(16)));
    typedef std::int64_t Both __attribute__((vector_size(16)));

    // By axis: the least of both children, and the greatest, negative. A box overlaps that asks for no less, in the same order of signs.
    struct alignas(64) Node {
        Four bounds[3];
        std::int32_t child[2];
    };
    struct Asked {
        Four bounds[3];
    };

    static Asked asked(const Aabb& box);

    // A nonzero half for each child that overlaps.
    static std::uint64_t overlaps(const Node& node, const Asked& box) {
        const Both hit = reinterpret_cast<Both>((node.bounds[0] <= box.bounds[0]) & (node.bounds[1] <= box.bounds[1]) &
                                                (node.bounds[2] <= box.bounds[2]));
        return static_cast<std::uint64_t>(hit[0] & hit[1]);
    }

    template <class Visit>
    void query_below(std::int32_t top, const Asked& box, Visit& visit) const {
        constexpr int kStackSize = 128;
        std::array<std::int32_t, kStackSize> stack;
        int size = 0;
        stack[size++] = top;
        while (size > 0) {
            const Node& node = nodes_[stack[--size]];
            const std::uint64_t hit = overlaps(node, box);
            const auto go_on = [&](std::int32_t child) {
                if (child < 0) {
                    visit(-1 - child);
                } else if (size < kStackSize) {
                    __builtin_prefetch(&nodes_[child]);
                    stack[size++] = child;
                } else {  // boxes nested in each other a hundredfold
                    query_below(child, box, visit);
                }
            };
            if ((hit >> 32) != 0) go_on(node.child[1]);
            if ((hit & UINT32_MAX) != 0) go_on(node.child[0]);
        }
    }

    std::vector<Node> nodes_;
};

}  // namespace cairn
