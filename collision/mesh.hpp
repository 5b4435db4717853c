// Static triangle mesh: one-sided triangles (counter-clockwise seen from outside, solid behind), a bounding volume hierarchy over them, and
// what the filter against ghost bumps needs of their neighbours.
#pragma once

#include "collision/mesh_tree.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace cairn {

class TriangleMesh {
public:
    // How the surface bends across an edge: not at all (one plane), hollow (also what is nearly flat), or as a ridge (also a border).
    enum class Bend : std::uint8_t { kNone, kHollow, kRidge };

    // What is near a shape is read triangle by triangle: all of one, in two lines of the cache.
    struct alignas(64) Triangle {
        std::array<Vec3, 3> corner;
        Vec3 normal;
        std::array<int, 3> vertex, neighbour;
        std::array<Bend, 3> bend;
        std::array<bool, 3> is_sharp;  // by more than a right angle across the edge
    };

    // Throws Error naming the triangle or vertex: not finite, an index out of range, a triangle without area.
    TriangleMesh(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles);

    const std::vector<Vec3>& vertices() const { return vertices_; }
    const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
    const Triangle& triangle(int t) const { return records_[static_cast<std::size_t>(t)]; }
    const Vec3& normal(int t) const { return triangle(t).normal; }
    // The triangle across edge k (from vertex k to vertex k+1) of this one, or −1 at a border.
    int neighbour(int t, int k) const { return triangle(t).neighbour[static_cast<std::size_t>(k)]; }
    Bend bend(int t, int k) const { return triangle(t).bend[static_cast<std::size_t>(k)]; }
    const Aabb& bounds() const { return bounds_; }

    // Triangles whose box overlaps `box` (both in the mesh's frame), in ascending order; appended to `out`.
    void query(const Aabb& box, std::vector<int>& out) const;
    // The same without those for which `misses` sets the flag in their leaf, and with a few that miss the box by rounding.
    template <class Misses>
    void query(const Aabb& box, const Misses& misses, std::vector<int>& out) const {
        const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(out.size());
        tree_->query(box, misses, [&](std::int32_t found) {
            const char* const record = reinterpret_cast<const char*>(&triangle(found));
            __builtin_prefetch(record);  // it will soon be asked for
            __builtin_prefetch(record + 64);
            out.push_back(found);
        });
        std::sort(out.begin() + first, out.end());
    }

private:
    std::vector<Vec3> vertices_;
    std::vector<std::array<int, 3>> triangles_;
    std::vector<Triangle> records_;
    std::optional<MeshTree> tree_;
    Aabb bounds_;
};

}  // namespace cairn
