// Mesh contacts: the query in the mesh's frame, and what the mesh knows of its edges.
#include "collision/narrow_mesh.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

std::uint32_t mix(std::uint64_t x) {
    x ^= x >> 31;
    x *= 0x9e3779b97f4a7c15ull;
    x ^= x >> 29;
    x *= 0xbf58476d1ce4e5b9ull;
    return static_cast<std::uint32_t>(x >> 32);
}

constexpr Real kBelow = 0.01;  // [rad] by which the surface may rise about a summit
constexpr int kMaxFan = 64;

// Whether both edges that leave corner k of a triangle fall away from n.
bool falls_away(const TriangleMesh& mesh, int triangle, int k, const Vec3& n) {
    const auto& corner = mesh.triangle(triangle).corner;
    for (int j = 1; j <= 2; ++j) {
        const Vec3 d = corner[(k + j) % 3] - corner[k];
        if (n.dot(d) > kBelow * d.norm()) return false;
    }
    return true;
}

// Which edge of `neighbour` borders on `triangle`.
int edge_towards(const TriangleMesh& mesh, int neighbour, int triangle) {
    for (int k = 0; k < 3; ++k)
        if (mesh.neighbour(neighbour, k) == triangle) return k;
    return -1;
}

using Four = MeshTree::Four;
using Leaf = MeshTree::Leaf;
using Flags = MeshTree::FourFlags;

constexpr float kSlack = 2e-6F;  // more than rounding makes of the magnitudes that enter a test in single precision

Four all(Real x) {
    return MeshTree::all(static_cast<float>(x));
}

Four magnitude(const Four& x) {
    return reinterpret_cast<Four>(reinterpret_cast<Flags>(x) & 0x7fffffff);
}

Four larger(const Four& x, const Four& y) {
    return x > y ? x : y;
}

// Boxes that are farther from a ball than it reaches.
struct BeyondBall {
    Four centre[3], slack, most2;

    BeyondBall(const Vec3& c, Real reach)
        : centre{all(c.x()), all(c.y()), all(c.z())},
          slack(all(kSlack * (c.lpNorm<1>() + reach))),
          most2(all(reach * reach * (1 + kSlack))) {}
    Flags operator()(const Leaf& leaf) const {
        Four sum = Four{};
        for (int k = 0; k < 3; ++k) {
            const Four aside = larger(larger(leaf.lo[k] - centre[k], centre[k] - leaf.hi[k]) - slack, Four{});
            sum += aside * aside;
        }
        return sum > most2;
    }
};

// Boxes that are beyond the reach of a shape along one of its own axes.
struct BesideShape {
    Four axis[3][3], size[3][3], middle[3], half[3];

    explicit BesideShape(const SolidReach& reach) {
        for (int k = 0; k < 3; ++k) {
            for (int j = 0; j < 3; ++j) {
                axis[k][j] = all(reach.to_local(k, j));
                size[k][j] = magnitude(axis[k][j]);
            }
            middle[k] = all(0.5 * (reach.lo[k] + reach.hi[k]));
            half[k] = all(0.5 * (reach.hi[k] - reach.lo[k]) + kSlack * (std::abs(reach.lo[k]) + std::abs(reach.hi[k])));
        }
    }
    Flags operator()(const Leaf& leaf) const {
        const Four half_all = all(0.5);
        Four c[3], h[3];
        for (int k = 0; k < 3; ++k) {
            c[k] = half_all * (leaf.hi[k] + leaf.lo[k]);
            h[k] = half_all * (leaf.hi[k] - leaf.lo[k]);
        }
        const Four slack = all(kSlack) * (magnitude(c[0]) + magnitude(c[1]) + magnitude(c[2]) + h[0] + h[1] + h[2]);
        Flags missed = Flags{};
        for (int k = 0; k < 3; ++k) {
            const Four apart = magnitude(axis[k][0] * c[0] + axis[k][1] * c[1] + axis[k][2] * c[2] - middle[k]);
            missed |= apart > half[k] + slack + (size[k][0] * h[0] + size[k][1] * h[1] + size[k][2] * h[2]);
        }
        return missed;
    }
};

}  // namespace

SolidReach::SolidReach(const PlacedShape& a, Real margin) : to_local(a.X_WS.R.transpose()) {
    for (int k = 0; k < 3; ++k) {
        const Vec3 axis = a.X_WS.R.col(k);
        lo[k] = -support(a, -axis) - margin;
        hi[k] = support(a, axis) + margin;
    }
}

bool is_summit(const TriangleMesh& mesh, int triangle, int k, const Vec3& n) {
    // Around the corner one way, and the other way if a border ends it.
    for (const bool forward : {true, false}) {
        int t = triangle, corner = k;
        for (int step = 0; step < kMaxFan; ++step) {
            if (!falls_away(mesh, t, corner, n)) return false;
            const int next = mesh.neighbour(t, forward ? corner : (corner + 2) % 3);
            if (next < 0) break;
            if (next == triangle) return true;
            const int edge = edge_towards(mesh, next, t);
            if (edge < 0) break;
            corner = forward ? (edge + 1) % 3 : edge;
            t = next;
        }
    }
    return true;
}

std::uint32_t plane_key(const Vec3& normal, Real offset, Real size) {
    constexpr Real kGrain = 1e-3;
    std::uint64_t h = 1;
    for (int k = 0; k < 3; ++k) h = h * 4099 + static_cast<std::uint64_t>(std::llround(normal[k] / kGrain) + 2000);
    const Real steps = std::clamp(offset / (kGrain * size), -1e15, 1e15);
    return mix(h * 1000003 + static_cast<std::uint64_t>(std::llround(steps)));
}

std::uint32_t edge_key(const TriangleMesh& mesh, int triangle, int corners) {
    std::uint64_t ends[2] = {0, 0};
    int count = 0;
    for (int k = 0; k < 3 && count < 2; ++k)
        if (corners & (1 << k)) ends[count++] = static_cast<std::uint64_t>(mesh.triangle(triangle).vertex[k]) + 1;
    if (ends[0] > ends[1]) std::swap(ends[0], ends[1]);
    return mix(ends[0] << 32 | ends[1]);
}

MeshEdge mesh_edge(const TriangleMesh& mesh, int triangle, int k) {
    MeshEdge e;
    const TriangleMesh::Triangle& t = mesh.triangle(triangle);
    e.neighbour = t.neighbour[k];
    if (e.neighbour < 0) return e;
    const Vec3 along = (t.corner[(k + 1) % 3] - t.corner[k]).normalized();
    e.away = mesh.normal(e.neighbour).cross(along);  // the neighbour runs along its edge the other way
    e.is_ridge = mesh.bend(triangle, k) == TriangleMesh::Bend::kRidge;
    return e;
}

void triangle_face(const TriangleMesh& mesh, int triangle, Face& face) {
    const TriangleMesh::Triangle& t = mesh.triangle(triangle);
    face.normal = t.normal;
    face.offset = face.normal.dot(t.corner[0]);
    face.index = 0;
    face.outline.count = 0;
    for (int k = 0; k < 3; ++k) face.outline.add(t.corner[k], static_cast<std::uint8_t>(k));
}

NarrowResult collide_with_mesh(Query& q) {
    q.may_cache = false;
    const TriangleMesh& mesh = *q.b.shape->mesh;
    const Transform& X_B = q.b.X_WS;
    const PlacedShape a{q.a.shape, {X_B.R.transpose() * q.a.X_WS.R, X_B.to_local(q.a.X_WS.p)}};
    Query local{a, q.b, q.margin, q.size, Vec3::Zero(), false, false, false, q.out, q.stats};

    thread_local std::vector<int> triangles;
    triangles.clear();
    const std::size_t first = q.out.size();
    NarrowResult result;
    const Aabb reach = shape_aabb(*a.shape, a.X_WS).grown(q.margin);
    if (a.shape->type == ShapeType::kSphere) {
        mesh.query(reach, BeyondBall(a.X_WS.p, a.shape->radius + q.margin), triangles);
        if (triangles.empty()) return NarrowResult::kSeparated;
        result = collide_sphere_with_mesh(local, mesh, triangles);
    } else {
        const SolidReach along_axes(a, q.margin);
        mesh.query(reach, BesideShape(along_axes), triangles);
        if (triangles.empty()) return NarrowResult::kSeparated;
        result = collide_solid_with_mesh(local, mesh, along_axes, triangles);
    }
    if (result == NarrowResult::kFailed) return result;
    const auto depth = [](const Manifold& m) {
        Real d = m.points[0].separation;
        for (int i = 1; i < m.count; ++i) d = std::min(d, m.points[i].separation);
        return d;
    };
    if (q.out.size() > first + kMaxMeshManifolds) {
        std::sort(q.out.begin() + static_cast<std::ptrdiff_t>(first), q.out.end(),
                  [&](const Manifold& m, const Manifold& o) { return depth(m) != depth(o) ? depth(m) < depth(o) : m.sub_key < o.sub_key; });
        q.out.resize(first + kMaxMeshManifolds);
    }
    for (std::size_t i = first; i < q.out.size(); ++i) {
        Manifold& m = q.out[i];
        for (std::size_t k = first; k < i; ++k)
            if (q.out[k].sub_key == m.sub_key) ++m.sub_key, k = first - 1;
        m.n = X_B.R * m.n;
        for (int k = 0; k < m.count; ++k) {
            m.points[k].core_a = X_B * m.points[k].core_a;
            m.points[k].core_b = X_B * m.points[k].core_b;
        }
    }
    return q.out.size() > first ? NarrowResult::kTouching : NarrowResult::kSeparated;
}

}  // namespace cairn::narrow
