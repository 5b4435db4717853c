// A sphere on a mesh: the nearest points of the triangles, each point of the surface once.
#include "collision/narrow_mesh.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

constexpr int kInside = 7;

struct Near {
    Vec3 point;
    Vec3 n;
    Real distance = 0;  // signed: negative behind the triangle
    int triangle = 0;
    int corners = 0;
};

// Whether a point of an edge or corner is nearest for every triangle that it belongs to: those bend away there, and it is a ridge. Else the
// sphere is nearer to one of them, which has its own point.
bool is_nearest_for_all(const TriangleMesh& mesh, const std::vector<Near>& all, const Near& c, Real size) {
    for (const Near& other : all) {
        if (std::abs(other.distance) >= std::abs(c.distance) - 1e-9 * size) continue;
        const auto& v = mesh.triangle(other.triangle).corner;
        Vec3 on_other;
        if (fcl_query::nearest_on_triangle(c.point, v[0], v[1], v[2], on_other) == 0) continue;
        if ((on_other - c.point).squaredNorm() < 1e-14 * size * size) return false;
    }
    return true;
}

}  // namespace

NarrowResult collide_sphere_with_mesh(Query& q, const TriangleMesh& mesh, const std::vector<int>& triangles) {
    const Vec3& centre = q.a.X_WS.p;
    const Real radius = q.a.shape->radius, reach = radius + q.margin;
    thread_local std::vector<Near> near;
    near.clear();
    for (const int t : triangles) {
        const auto& corner = mesh.triangle(t).corner;
        const Vec3& normal = mesh.triangle(t).normal;
        const Real height = normal.dot(centre - corner[0]);
        if (height < -radius || height >= reach) continue;
        ++q.stats.fcl_calls;
        Near c;
        c.corners = fcl_query::nearest_on_triangle(centre, corner[0], corner[1], corner[2], c.point);
        if (c.corners == 0) return failed(q);
        c.triangle = t;
        if (c.corners == kInside) {
            c.n = normal;
            c.distance = height;
        } else {
            const Vec3 d = centre - c.point;
            c.distance = d.norm();
            c.n = c.distance > 1e-9 * radius ? Vec3(d / c.distance) : normal;
            if (height < 0) c.distance = -c.distance;
        }
        if (c.distance < reach) near.push_back(c);
    }

    const std::size_t first = q.out.size();
    for (const Near& c : near) {
        // Exactly over an edge rounding decides between inside and edge: the normal tells that it is a face's.
        const bool face = c.corners == kInside || c.n.dot(mesh.normal(c.triangle)) > 1 - 1e-12;
        if (!face && (c.distance < 0 || !is_nearest_for_all(mesh, near, c, radius))) continue;
        const Vec3 n = face ? mesh.normal(c.triangle) : c.n;
        const bool known = std::any_of(q.out.begin() + static_cast<std::ptrdiff_t>(first), q.out.end(), [&](const Manifold& m) {
            return m.n.dot(n) > 1 - 1e-10 && (m.points[0].core_b - c.point).squaredNorm() < 1e-12 * radius * radius;
        });
        if (known || add_point(q, n, face ? NormalOwner::kB : NormalOwner::kNone, centre, radius, centre - c.distance * n, 0, 1) !=
                         NarrowResult::kTouching)
            continue;
        q.out.back().sub_key = face ? plane_key(n, n.dot(c.point), q.size) : edge_key(mesh, c.triangle, c.corners);
    }
    return NarrowResult::kTouching;
}

}  // namespace cairn::narrow
