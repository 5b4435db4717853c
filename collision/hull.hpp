// Convex hull of a point set: vertices, planar faces with counter-clockwise loops, edges. Built once (Qhull), then constant.
#pragma once

#include "collision/aabb.hpp"

#include <span>
#include <vector>

namespace cairn {

class ConvexHull {
public:
    // A planar face: outward unit normal, normal·x = offset on it, and its vertices, counter-clockwise seen from outside:
    // loop[first] … loop[first + count − 1].
    struct Face {
        Vec3 normal = Vec3::Zero();
        Real offset = 0;
        int first = 0;
        int count = 0;
    };

    // Throws Error if fewer than 4 points, not finite, or without volume. Points inside the hull and duplicates are dropped; coplanar
    // facets are merged into one face.
    explicit ConvexHull(const std::vector<Vec3>& points);

    const std::vector<Vec3>& vertices() const { return vertices_; }
    const std::vector<Face>& faces() const { return faces_; }
    const std::vector<int>& loop() const { return loop_; }  // vertex indices of all faces, one face after the other
    // The vertices that share an edge with vertex i.
    std::span<const int> neighbours(int i) const {
        return {neighbours_.data() + neighbour_begin_[i], neighbours_.data() + neighbour_begin_[i + 1]};
    }
    // The faces that hold vertex i, in ascending order.
    std::span<const int> faces_of(int i) const {
        return {faces_of_.data() + neighbour_begin_[i], faces_of_.data() + neighbour_begin_[i + 1]};
    }
    const Vec3& centroid() const { return centroid_; }
    Real inner_radius() const { return inner_radius_; }  // of the largest centred (at the centroid) sphere inside
    Real outer_radius() const { return outer_radius_; }  // of the sphere about the shape's origin that holds all vertices

    // Index of a vertex farthest along d (need not be unit). Deterministic.
    int support(const Vec3& d) const;
    // Index of the face whose normal goes farthest along d (likewise).
    int face_along(const Vec3& d) const;
    // max d·v over the vertices.
    Real extent(const Vec3& d) const;
    // The box of the hull turned by R.
    Aabb bounds(const Mat3& R) const;

private:
    void find_neighbours();

    std::vector<Vec3> vertices_;
    std::vector<Real> coordinates_, normals_;  // of vertices and faces, two and two: x x y y z z
    std::vector<Face> faces_;
    std::vector<int> loop_;
    std::vector<int> neighbours_, faces_of_, neighbour_begin_;  // of vertex i: those from neighbour_begin_[i] on, as many of both
    Vec3 centroid_ = Vec3::Zero();
    Real inner_radius_ = 0;
    Real outer_radius_ = 0;
};

}  // namespace cairn
