// Static triangle mesh: one-sided triangles (counter-clockwise seen from outside, solid behind), a bounding volume hierarchy over them, and
// what the filter against ghost bumps needs of their neighbours.
#pragma once

#include "collision/aabb.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace cairn {

class TriangleMesh {
public:
    // Throws Error naming the triangle or vertex: not finite, an index out of range, a triangle without area.
    TriangleMesh(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles);

    const std::vector<Vec3>& vertices() const { return vertices_; }
    const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
    const Vec3& normal(int triangle) const { return normals_[triangle]; }
    // The triangle across edge k (from vertex k to vertex k+1) of this one, or −1 at a border.
    int neighbour(int triangle, int k) const { return neighbours_[triangle][k]; }
    const Aabb& bounds() const { return bounds_; }

    // Triangles whose box overlaps `box` (both in the mesh's frame), in ascending order; appended to `out`.
    void query(const Aabb& box, std::vector<int>& out) const;

private:
    struct Node {
        Aabb box;
        std::int32_t right = 0;  // inner: index of the second child (the first follows the node); leaf: first triangle in order_
        std::int32_t count = 0;  // leaf: triangles in it; inner: 0
    };
    std::vector<Vec3> vertices_;
    std::vector<std::array<int, 3>> triangles_;
    std::vector<Vec3> normals_;
    std::vector<std::array<int, 3>> neighbours_;
    std::vector<Node> nodes_;
    std::vector<int> order_;
    Aabb bounds_;
};

}  // namespace cairn
