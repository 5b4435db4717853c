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
    const std::array<int, 3>& t = mesh.triangles()[triangle];
    const auto& v = mesh.vertices();
    for (int j = 1; j <= 2; ++j) {
        const Vec3 d = v[t[(k + j) % 3]] - v[t[k]];
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

// Triangles whose boxes come nearer to a shape (in the mesh's frame) than the margin: of a sphere by their distance from its centre, else
// along the shape's own axes.
void find_triangles(const TriangleMesh& mesh, const PlacedShape& a, Real margin, std::vector<int>& out) {
    const Aabb reach = shape_aabb(*a.shape, a.X_WS).grown(margin);
    if (a.shape->type == ShapeType::kSphere) {
        const Vec3& centre = a.X_WS.p;
        const Real most = a.shape->radius + margin;
        const auto is_near = [&](const Aabb& box) {
            const Vec3 aside = (box.lo - centre).cwiseMax(centre - box.hi).cwiseMax(0.0);
            return aside.squaredNorm() < most * most;
        };
        mesh.query(reach, is_near, is_near, out);
        return;
    }
    const Mat3& R = a.X_WS.R;
    Vec3 middle, half;  // along the shape's axes
    for (int k = 0; k < 3; ++k) {
        const Real hi = support(a, R.col(k)), lo = -support(a, -R.col(k));
        middle[k] = 0.5 * (lo + hi);
        half[k] = 0.5 * (hi - lo) + margin;
    }
    const Mat3 M = R.transpose(), size = M.cwiseAbs();
    const auto is_near = [&](const Aabb& box) {
        const Vec3 apart = (0.5 * (M * (box.lo + box.hi)) - middle).cwiseAbs() - half - 0.5 * (size * (box.hi - box.lo));
        return apart.maxCoeff() < 0;
    };
    mesh.query(
        reach, [](const Aabb&) { return true; }, is_near, out);
}

}  // namespace

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
        if (corners & (1 << k)) ends[count++] = static_cast<std::uint64_t>(mesh.triangles()[triangle][k]) + 1;
    if (ends[0] > ends[1]) std::swap(ends[0], ends[1]);
    return mix(ends[0] << 32 | ends[1]);
}

MeshEdge mesh_edge(const TriangleMesh& mesh, int triangle, int k) {
    MeshEdge e;
    e.neighbour = mesh.neighbour(triangle, k);
    if (e.neighbour < 0) return e;
    const std::array<int, 3>& t = mesh.triangles()[triangle];
    const Vec3& p = mesh.vertices()[t[k]];
    const Vec3 along = (mesh.vertices()[t[(k + 1) % 3]] - p).normalized();
    e.away = mesh.normal(e.neighbour).cross(along);  // the neighbour runs along its edge the other way
    e.is_ridge = mesh.bend(triangle, k) == TriangleMesh::Bend::kRidge;
    return e;
}

void triangle_face(const TriangleMesh& mesh, int triangle, Face& face) {
    const std::array<int, 3>& t = mesh.triangles()[triangle];
    face.normal = mesh.normal(triangle);
    face.offset = face.normal.dot(mesh.vertices()[t[0]]);
    face.index = 0;
    face.outline.count = 0;
    for (int k = 0; k < 3; ++k) face.outline.add(mesh.vertices()[t[k]], static_cast<std::uint8_t>(k));
}

NarrowResult collide_with_mesh(Query& q) {
    q.may_cache = false;
    const TriangleMesh& mesh = *q.b.shape->mesh;
    const Transform& X_B = q.b.X_WS;
    const PlacedShape a{q.a.shape, {X_B.R.transpose() * q.a.X_WS.R, X_B.to_local(q.a.X_WS.p)}};
    Query local{a, q.b, q.margin, q.size, Vec3::Zero(), false, false, false, q.out, q.stats};

    thread_local std::vector<int> triangles;
    triangles.clear();
    find_triangles(mesh, a, q.margin, triangles);
    if (triangles.empty()) return NarrowResult::kSeparated;

    const std::size_t first = q.out.size();
    const NarrowResult result = a.shape->type == ShapeType::kSphere ? collide_sphere_with_mesh(local, mesh, triangles)
                                                                    : collide_solid_with_mesh(local, mesh, triangles);
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
