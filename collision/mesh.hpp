// Static triangle mesh: one-sided triangles (counter-clockwise seen from outside, solid behind), a bounding volume hierarchy over them, and
// what the filter against ghost bumps needs of their neighbours.
#pragma once

#include "collision/aabb.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace cairn {

class TriangleMesh {
public:
    // How the surface bends across an edge: not at all (one plane), hollow (also what is nearly flat), or as a ridge (also a border).
    enum class Bend : std::uint8_t { kNone, kHollow, kRidge };

    // Throws Error naming the triangle or vertex: not finite, an index out of range, a triangle without area.
    TriangleMesh(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles);

    const std::vector<Vec3>& vertices() const { return vertices_; }
    const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
    const Vec3& normal(int triangle) const { return normals_[triangle]; }
    // The triangle across edge k (from vertex k to vertex k+1) of this one, or −1 at a border.
    int neighbour(int triangle, int k) const { return neighbours_[triangle][k]; }
    Bend bend(int triangle, int k) const { return bends_[triangle][k]; }
    const Aabb& bounds() const { return bounds_; }

    // Triangles whose box overlaps `box` (both in the mesh's frame), in ascending order; appended to `out`.
    void query(const Aabb& box, std::vector<int>& out) const {
        const auto all = [](const Aabb&) { return true; };
        query(box, all, all, out);
    }
    // The same of triangles for whose boxes `may_reach` is true, in nodes for which `may_hold` is.
    template <class MayHold, class MayReach>
    void query(const Aabb& box, const MayHold& may_hold, const MayReach& may_reach, std::vector<int>& out) const;

private:
    static constexpr int kStackSize = 64;  // more than BoxSplitter's deepest tree

    struct Node {
        Aabb box;
        std::int32_t right = 0;  // inner: index of the second child (the first follows the node); leaf: first triangle in order_
        std::int32_t count = 0;  // leaf: triangles in it; inner: 0
    };
    std::vector<Vec3> vertices_;
    std::vector<std::array<int, 3>> triangles_;
    std::vector<Vec3> normals_;
    std::vector<std::array<int, 3>> neighbours_;
    std::vector<std::array<Bend, 3>> bends_;
    std::vector<Node> nodes_;
    std::vector<int> order_;
    std::vector<Aabb> boxes_;  // of the triangles, in that order
    Aabb bounds_;
};

template <class MayHold, class MayReach>
void TriangleMesh::query(const Aabb& box, const MayHold& may_hold, const MayReach& may_reach, std::vector<int>& out) const {
    const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(out.size());
    std::array<int, kStackSize> stack;
    int size = 0;
    stack[size++] = 0;
    while (size > 0) {
        const int index = stack[--size];
        const Node& node = nodes_[index];
        if (!node.box.overlaps(box) || !may_hold(node.box)) continue;
        if (node.count == 0) {
            stack[size++] = node.right;
            stack[size++] = index + 1;
            continue;
        }
        for (int i = node.right; i < node.right + node.count; ++i)
            if (boxes_[i].overlaps(box) && may_reach(boxes_[i])) out.push_back(order_[i]);
    }
    std::sort(out.begin() + begin, out.end());
}

}  // namespace cairn
