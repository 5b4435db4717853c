// A bounding volume hierarchy over the triangles of a mesh. Internal to TriangleMesh.
//
// The boxes of a leaf's triangles lie side by side, four to a leaf, in single precision and rounded outwards: a query tests four at once,
// finds every triangle that it should, and now and then one that misses by rounding.
#pragma once

#include "collision/flat_tree.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace cairn {

class MeshTree {
public:
    static constexpr int kLeafSize = 4;

    // Four floats and what comparing them gives, by GCC's and Clang's vector types.
    typedef float Four __attribute__((vector_size(16)));
    typedef std::int32_t FourFlags __attribute__((vector_size(16)));

    struct alignas(64) Leaf {
        Four lo[3], hi[3];
        std::array<std::int32_t, kLeafSize> triangle;
        std::int32_t count = 0;
    };

    explicit MeshTree(const std::vector<Aabb>& boxes);

    // Calls visit(triangle) for every triangle whose box overlaps `box`, unless `misses`(leaf) sets its flag.
    template <class Misses, class Visit>
    void query(const Aabb& box, const Misses& misses, Visit&& visit) const {
        const Four lo[3] = {all(below(box.lo.x())), all(below(box.lo.y())), all(below(box.lo.z()))};
        const Four hi[3] = {-all(below(-box.hi.x())), -all(below(-box.hi.y())), -all(below(-box.hi.z()))};
        const auto look = [&](std::int32_t index) {
            const Leaf& leaf = leaves_[static_cast<std::size_t>(index)];
            FourFlags hit = (leaf.lo[0] <= hi[0]) & (lo[0] <= leaf.hi[0]) & (leaf.lo[1] <= hi[1]) & (lo[1] <= leaf.hi[1]) &
                            (leaf.lo[2] <= hi[2]) & (lo[2] <= leaf.hi[2]);
            if ((hit[0] | hit[1] | hit[2] | hit[3]) == 0) return;
            hit &= ~misses(leaf);
            for (int i = 0; i < leaf.count; ++i)
                if (hit[i] != 0) visit(leaf.triangle[static_cast<std::size_t>(i)]);
        };
        // Leaves come from memory while others are found.
        std::array<std::int32_t, 64> found;
        std::size_t count = 0;
        const auto look_at_found = [&] {
            for (std::size_t i = 0; i < count; ++i) look(found[i]);
            count = 0;
        };
        const auto note = [&](std::int32_t index) {
            const char* const leaf = reinterpret_cast<const char*>(&leaves_[static_cast<std::size_t>(index)]);
            __builtin_prefetch(leaf);
            __builtin_prefetch(leaf + 64);
            found[count++] = index;
            if (count == found.size()) look_at_found();
        };
        if (inner_.empty())
            note(0);
        else
            inner_.query(box, note);
        look_at_found();
    }

    static Four all(float x) { return Four{x, x, x, x}; }
    static float below(Real x) { return FlatTree::rounded_down(x); }

private:
    void add_leaf(const std::vector<Aabb>& boxes, const int* first, const int* last);

    FlatTree inner_;  // its leaves are places in leaves_
    std::vector<Leaf> leaves_;
};

}  // namespace cairn
