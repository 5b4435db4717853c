#include "collision/mesh.hpp"

#include "engine/base/error.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace cairn {
namespace {

constexpr Real kOneNormal = 1e-5;  // [rad] between triangles of one plane
constexpr Real kRidge = 2e-3;      // [rad] by which a convex edge must bend to be one
constexpr Real kSliver = 1e-12;    // smallest area relative to the longest edge squared

using Indices = std::array<int, 3>;

void check_vertices(const std::vector<Vec3>& vertices) {
    for (std::size_t i = 0; i < vertices.size(); ++i)
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(vertices[i][k])) throw_invalid("mesh vertex " + std::to_string(i), vertices[i][k], "finite");
}

void check_indices(const std::vector<Indices>& triangles, int vertex_count) {
    if (triangles.empty()) throw_invalid("mesh, number of triangles", 0, "> 0");
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (const int i : triangles[t])
            if (i < 0 || i >= vertex_count)
                throw_invalid("mesh triangle " + std::to_string(t) + ", vertex index", i, "in [0, " + std::to_string(vertex_count) + ")");
}

std::vector<Vec3> unit_normals(const std::vector<Vec3>& vertices, const std::vector<Indices>& triangles) {
    std::vector<Vec3> normals;
    normals.reserve(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const Vec3& a = vertices[triangles[t][0]];
        const Vec3& b = vertices[triangles[t][1]];
        const Vec3& c = vertices[triangles[t][2]];
        const Vec3 area = (b - a).cross(c - a);
        const Real longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
        if (!(area.norm() > kSliver * longest))
            throw_invalid("mesh triangle " + std::to_string(t) + ", area", area.norm() / 2, "> 0 (its vertices lie on a line)");
        normals.push_back(area.normalized());
    }
    return normals;
}

// For each vertex the first one, in order of position, that stands at exactly the same place.
std::vector<int> welded(const std::vector<Vec3>& vertices) {
    std::vector<int> order(vertices.size());
    std::iota(order.begin(), order.end(), 0);
    const auto position = [&](int i) { return std::make_tuple(vertices[i].x(), vertices[i].y(), vertices[i].z()); };
    std::sort(order.begin(), order.end(), [&](int a, int b) { return std::make_tuple(position(a), a) < std::make_tuple(position(b), b); });
    std::vector<int> first(vertices.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && position(order[i]) == position(order[i - 1]);
        first[order[i]] = same ? first[order[i - 1]] : order[i];
    }
    return first;
}

struct DirectedEdge {
    int from, to, triangle;
    bool operator<(const DirectedEdge& e) const { return std::tie(from, to, triangle) < std::tie(e.from, e.to, e.triangle); }
};

std::vector<Indices> find_neighbours(const std::vector<Vec3>& vertices, const std::vector<Indices>& triangles) {
    const std::vector<int> id = welded(vertices);
    std::vector<DirectedEdge> edges;
    edges.reserve(3 * triangles.size());
    for (int t = 0; t < static_cast<int>(triangles.size()); ++t)
        for (int k = 0; k < 3; ++k) edges.push_back({id[triangles[t][k]], id[triangles[t][(k + 1) % 3]], t});
    std::sort(edges.begin(), edges.end());

    std::vector<Indices> neighbours(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const DirectedEdge twin{id[triangles[t][(k + 1) % 3]], id[triangles[t][k]], 0};
            const auto found = std::lower_bound(edges.begin(), edges.end(), twin);
            const bool shared = found != edges.end() && found->from == twin.from && found->to == twin.to;
            neighbours[t][k] = shared ? found->triangle : -1;
        }
    return neighbours;
}

using Bend = TriangleMesh::Bend;

// Across an edge of a triangle with normal n, `along` it, to a neighbour with normal m.
Bend bend_between(const Vec3& n, const Vec3& m, const Vec3& along) {
    if ((m - n).squaredNorm() < kOneNormal * kOneNormal) return Bend::kNone;
    const Real bend = n.cross(m).dot(along);  // positive: convex
    return bend > kRidge || (n.dot(m) < 0 && bend > -kRidge) ? Bend::kRidge : Bend::kHollow;
}

Aabb box_of(const TriangleMesh::Triangle& t) {
    const Vec3 &a = t.corner[0], &b = t.corner[1], &c = t.corner[2];
    return {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
}

}  // namespace

TriangleMesh::TriangleMesh(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles)) {
    check_vertices(vertices_);
    check_indices(triangles_, static_cast<int>(vertices_.size()));
    const std::vector<Vec3> normals = unit_normals(vertices_, triangles_);
    const std::vector<Indices> neighbours = find_neighbours(vertices_, triangles_);
    records_.resize(triangles_.size());
    std::vector<Aabb> boxes;
    boxes.reserve(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
        Triangle& record = records_[t];
        record.vertex = triangles_[t];
        record.neighbour = neighbours[t];
        record.normal = normals[t];
        for (int k = 0; k < 3; ++k) record.corner[k] = vertices_[triangles_[t][k]];
        for (int k = 0; k < 3; ++k) {
            const int other = neighbours[t][k];
            const Vec3 along = (record.corner[(k + 1) % 3] - record.corner[k]).normalized();
            record.is_sharp[k] = other >= 0 && normals[t].dot(normals[other]) < 0;
            record.bend[k] = other < 0 ? Bend::kRidge : bend_between(normals[t], normals[other], along);
        }
        boxes.push_back(box_of(record));
        bounds_ = t == 0 ? boxes[0] : bounds_.merged(boxes[t]);
    }
    tree_.emplace(boxes);
}

void TriangleMesh::query(const Aabb& box, std::vector<int>& out) const {
    const std::size_t first = out.size();
    query(
        box, [](const MeshTree::Leaf&) { return MeshTree::FourFlags{}; }, out);
    const auto misses = [&](int t) { return !box_of(triangle(t)).overlaps(box); };
    out.erase(std::remove_if(out.begin() + static_cast<std::ptrdiff_t>(first), out.end(), misses), out.end());
}

}  // namespace cairn
