// Boxes, hulls, capsules and cylinders on a mesh.
//
// Triangles of one plane are one face: the shape's lowest feature is clipped by each of them, inner edges add nothing, and the region as a
// whole keeps at most four points. Where the lowest point along the face's normal lies over the face, that is the contact. Elsewhere the
// shape may touch with a face or an edge of its own on a ridge of the mesh: FCL's GJK tells, triangle by triangle, and what it says is
// admitted only between the normals of the triangles that meet there.
#include "collision/narrow_mesh.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

using fcl_query::Answer;

constexpr Real kOneNormal = 1e-5;  // [rad] and
constexpr Real kOnePlane = 1e-5;   // of the size: how far triangles of one face may be from one plane
constexpr Real kFar = 0.05;        // of the inner radius: how far the core is drawn in
constexpr Real kBeside = 0.01;     // [rad] from a triangle's normal that is as good as it

struct Region {
    Vec3 normal;
    Real offset = 0;
    Real lowest = 0;      // separation of the shape from the plane
    Candidate deepest;    // of the points
    int deepest_on = -1;  // and its triangle; −1: no points
    bool flat = false;    // the shape comes down on it with its face
    Face own;             // that one
    std::vector<int> triangles;
    std::vector<Candidate> points;
};

// Contacts with the mesh's ridges that share a normal.
struct Ridge {
    Vec3 n;
    bool on_own_face = false;  // n is that of a face of the shape
    std::uint32_t key = 0;
    std::vector<Candidate> points;  // core on the mesh, foot on the shape
};

struct Scratch {
    std::vector<Region> regions;
    std::vector<Ridge> ridges;
    std::size_t region_count = 0;
    std::size_t ridge_count = 0;

    Region& new_region() {
        if (region_count == regions.size()) regions.emplace_back();
        Region& r = regions[region_count++];
        r.triangles.clear();
        r.points.clear();
        r.deepest_on = -1;
        return r;
    }
    Ridge& new_ridge() {
        if (ridge_count == ridges.size()) ridges.emplace_back();
        Ridge& r = ridges[ridge_count++];
        r.points.clear();
        return r;
    }
};

Vec3 middle(const TriangleMesh& mesh, int t) {
    const std::array<int, 3>& v = mesh.triangles()[t];
    return (mesh.vertices()[v[0]] + mesh.vertices()[v[1]] + mesh.vertices()[v[2]]) / 3;
}

// The shape's extent along its own axes, either way: triangles beyond it by more than the margin are out of reach.
struct Reach {
    Vec3 axis[6];
    Real most[6];

    explicit Reach(const Query& q) {
        for (int k = 0; k < 6; ++k) {
            axis[k] = k < 3 ? Vec3(q.a.X_WS.R.col(k)) : Vec3(-q.a.X_WS.R.col(k - 3));
            most[k] = support(q.a, axis[k]) + q.margin;
        }
    }
    bool misses(const TriangleMesh& mesh, int t) const {
        const std::array<int, 3>& v = mesh.triangles()[t];
        for (int k = 0; k < 6; ++k) {
            bool beyond = true;
            for (const int i : v) beyond = beyond && axis[k].dot(mesh.vertices()[i]) >= most[k];
            if (beyond) return true;
        }
        return false;
    }
};

// Sorts the triangles that the shape may touch from the front into planes.
void gather(const Query& q, const TriangleMesh& mesh, const std::vector<int>& triangles, Scratch& s) {
    s.region_count = s.ridge_count = 0;
    const Reach reach(q);
    for (const int t : triangles) {
        if (reach.misses(mesh, t)) continue;
        const Vec3& n = mesh.normal(t);
        const Real offset = n.dot(mesh.vertices()[mesh.triangles()[t][0]]);
        const Real lowest = -support(q.a, -n) - offset;
        if (lowest >= q.margin || support(q.a, n) < offset) continue;
        const auto same = [&](const Region& r) {
            return (r.normal - n).squaredNorm() < kOneNormal * kOneNormal &&
                   std::abs(r.normal.dot(middle(mesh, t)) - r.offset) < kOnePlane * q.size;
        };
        const auto end = s.regions.begin() + static_cast<std::ptrdiff_t>(s.region_count);
        const auto found = std::find_if(s.regions.begin(), end, same);
        Region& r = found != end ? *found : s.new_region();
        if (r.triangles.empty()) {
            r.normal = n;
            r.offset = offset;
            r.lowest = lowest;
            r.flat = comes_down_flat(q.a, n, r.own);
            r.own.disc_radius = 0;
        }
        r.triangles.push_back(t);
    }
}

bool add_distinct(std::vector<Candidate>& points, const Candidate& c, Real size) {
    for (const Candidate& p : points)
        if (p.feature == c.feature || (p.core - c.core).squaredNorm() < 1e-14 * size * size) return false;
    points.push_back(c);
    return true;
}

// The shape's lowest feature over one triangle of a region. What is cut off by an edge inside the region goes on in the next triangle.
void clip_to_triangle(const Query& q, const TriangleMesh& mesh, int t, Region& region) {
    Face face;
    triangle_face(mesh, t, face);
    face.normal = region.normal;
    face.offset = region.offset;
    Candidate found[kMaxCandidates];
    // A disc's four rim points may come to lie over different triangles: here it is its outline.
    const int count =
        region.flat ? flat_candidates(region.own, face, q.margin, q.size, found) : face_candidates(q.a, face, q.margin, q.size, found);
    const auto inner = [&](int k) {
        const int neighbour = mesh.neighbour(t, k);
        return neighbour >= 0 && (mesh.normal(neighbour) - mesh.normal(t)).squaredNorm() < kOneNormal * kOneNormal;
    };
    for (int i = 0; i < count; ++i) {
        Candidate& c = found[i];
        if (region.deepest_on < 0 || c.separation < region.deepest.separation) {
            region.deepest = c;
            region.deepest_on = t;
        }
        const int in = static_cast<int>(c.feature >> 8 & 0xff), out = static_cast<int>(c.feature & 0xff);
        const bool in_side = in >= kSideBit, out_side = out >= kSideBit;
        if (in_side && out_side) {  // a corner of the mesh under the shape's face
            if (inner(in - kSideBit) && inner(out - kSideBit)) continue;
            const int corner = (in - kSideBit + 1) % 3 == out - kSideBit ? out - kSideBit : in - kSideBit;
            c.feature = 0x80000000u | static_cast<std::uint32_t>(mesh.triangles()[t][corner]);
        } else if (in_side || out_side) {
            const int side = (in_side ? in : out) - kSideBit;
            if (inner(side)) continue;
            c.feature = (c.feature & 0x7fff0000u) ^ static_cast<std::uint32_t>((3 * t + side) * 64 + (in_side ? out : in)) ^
                        (in_side ? 0x40000000u : 0u);
        }
        add_distinct(region.points, c, q.size);
    }
}

// Whether the shape's lowest point over the region's plane lies over the region itself; FCL has the last word on the point.
bool is_proven(Query& q, const TriangleMesh& mesh, const Region& r) {
    if (r.deepest_on < 0 || r.deepest.separation > r.lowest + 0.02 * std::abs(r.lowest) + 1e-5 * q.size) return false;
    const std::array<int, 3>& t = mesh.triangles()[r.deepest_on];
    const auto& v = mesh.vertices();
    ++q.stats.fcl_calls;
    Vec3 nearest;
    return fcl_query::nearest_on_triangle(r.deepest.core, v[t[0]], v[t[1]], v[t[2]], nearest) != 0 &&
           (nearest - r.deepest.foot).norm() < 1e-4 * q.size;
}

void add_region_manifold(Query& q, Region& r) {
    add_face_manifold(q, r.normal, true, r.points.data(), static_cast<int>(r.points.size()));
    q.out.back().sub_key = plane_key(r.normal, r.offset, q.size);
}

// What a direction means for a triangle that it was found on.
enum class Verdict { kFace, kRidge, kElsewhere };

// `corners`: the corners of triangle t that span the feature touched.
Verdict judge(const TriangleMesh& mesh, int t, int corners, const Vec3& n) {
    constexpr int kEdgeCorners[3] = {3, 6, 5};
    const Vec3& normal = mesh.normal(t);
    if (corners == 7 || (n - normal).squaredNorm() < kBeside * kBeside) return Verdict::kFace;
    bool any_ridge = false;
    for (int k = 0; k < 3; ++k) {
        if ((corners & ~kEdgeCorners[k]) != 0) continue;  // the feature is not on this edge
        const MeshEdge e = mesh_edge(mesh, t, k);
        any_ridge = any_ridge || e.is_ridge;
        if (corners == kEdgeCorners[k] && e.is_ridge && e.neighbour >= 0 && n.dot(e.away) < kBeside) return Verdict::kElsewhere;
    }
    if (!any_ridge) return Verdict::kFace;
    for (int k = 0; k < 3; ++k)
        if (corners == 1 << k && !is_summit(mesh, t, k, n)) return Verdict::kElsewhere;
    return Verdict::kRidge;
}

Ridge& ridge_along(Scratch& s, const Vec3& n, bool on_own_face, std::uint32_t key) {
    for (std::size_t i = 0; i < s.ridge_count; ++i)
        if (s.ridges[i].on_own_face == on_own_face && s.ridges[i].n.dot(n) > 1 - 1e-8) return s.ridges[i];
    Ridge& r = s.new_ridge();
    r.n = n;
    r.on_own_face = on_own_face;
    r.key = key;
    return r;
}

// A ridge of the mesh under a face of the shape: the part of the triangle over that face.
bool add_under_own_face(const Query& q, const TriangleMesh& mesh, int t, const Vec3& n, Scratch& s) {
    Vec3 own;
    if (!face_normal_towards(q.a, -n, own) || own.cross(n).norm() > kBeside) return false;
    Face face, triangle;
    face_towards(q.a, own, face);
    triangle_face(mesh, t, triangle);
    Polygon clipped;
    clip(triangle.outline, face, 1e-5 * q.size, clipped);
    bool any = false;
    for (int i = 0; i < clipped.count; ++i) {
        const Vec3& p = clipped.corner[i];
        const Real height = face.normal.dot(p) - face.offset;
        if (height >= q.margin) continue;
        const int in = clipped.edge[i == 0 ? clipped.count - 1 : i - 1], out = clipped.edge[i];
        const bool corner = in < kSideBit && out < kSideBit;
        const std::uint32_t feature =
            corner ? static_cast<std::uint32_t>(mesh.triangles()[t][out])
                   : 0x40000000u | ((static_cast<std::uint32_t>(t) << 14) ^ static_cast<std::uint32_t>(in * 128 + out));
        Ridge& r = ridge_along(s, -own, true, 0x10000u + static_cast<std::uint32_t>(face.index));
        add_distinct(r.points, {p, p - height * face.normal, 0, height, feature}, q.size);
        any = true;
    }
    return any;
}

// A ridge against an edge of the shape: one point on either, where FCL saw them closest, brought out to the surfaces.
void add_bare(const Query& q, const TriangleMesh& mesh, int t, int corners, const fcl_query::Closest& closest, Scratch& s) {
    const Vec3& n = closest.n;
    const std::array<int, 3>& v = mesh.triangles()[t];
    const auto& vertices = mesh.vertices();
    const Real top = std::max({n.dot(vertices[v[0]]), n.dot(vertices[v[1]]), n.dot(vertices[v[2]])});
    const Real bottom = -support(q.a, -n);
    if (bottom - top >= q.margin) return;
    const bool capsule = q.a.shape->type == ShapeType::kCapsule;
    const Real radius = capsule ? q.a.shape->radius : 0;
    const Vec3 on_a = closest.a + (bottom + radius - n.dot(closest.a)) * n;
    const Vec3 on_mesh = closest.a + (top - n.dot(closest.a)) * n;
    const std::uint32_t key = edge_key(mesh, t, corners);
    Ridge& r = ridge_along(s, n, false, key);
    // `foot` is the core on the shape and `radius` its own.
    add_distinct(r.points, {on_mesh, on_a, radius, bottom - top, key}, q.size);
}

// A triangle whose plane the shape reaches beside its lowest point.
bool examine(Query& q, const TriangleMesh& mesh, int t, Region& region, Scratch& s) {
    ++q.stats.fcl_calls;
    fcl_query::Core a, b;
    make_core(q.a, kFar, a);
    const std::array<int, 3>& v = mesh.triangles()[t];
    const Vec3 corner[3] = {mesh.vertices()[v[0]], mesh.vertices()[v[1]], mesh.vertices()[v[2]]};
    b.kind = fcl_query::Core::Kind::kPoints;
    b.points = corner;
    b.count = 3;
    fcl_query::Closest closest;
    const Answer answer = fcl_query::gjk(a, b, region.normal, q.size, closest);
    Verdict verdict = Verdict::kFace;
    int corners = 7;
    if (answer == Answer::kApart) {
        if (closest.n.dot(region.normal) <= 0) return true;  // from behind
        const Real top = std::max({closest.n.dot(corner[0]), closest.n.dot(corner[1]), closest.n.dot(corner[2])});
        if (-support(q.a, -closest.n) - top >= q.margin) return true;
        Vec3 nearest;
        corners = fcl_query::nearest_on_triangle(closest.b, corner[0], corner[1], corner[2], nearest);
        if (corners == 0) return false;
        // Rounding may move the point off its corner or edge: the touching feature is level along n.
        int level = 0;
        for (int k = 0; k < 3; ++k)
            if (closest.n.dot(corner[k]) > top - 1e-6 * q.size) level |= 1 << k;
        if ((corners & level) != 0) corners &= level;
        verdict = judge(mesh, t, corners, closest.n);
    }
    if (verdict == Verdict::kFace) clip_to_triangle(q, mesh, t, region);
    if (verdict == Verdict::kRidge && !add_under_own_face(q, mesh, t, closest.n, s)) add_bare(q, mesh, t, corners, closest, s);
    return answer != Answer::kFailed;
}

void add_ridge_manifold(Query& q, Ridge& r) {
    const int count = reduce(r.points.data(), static_cast<int>(r.points.size()), r.n, 1e-4 * q.size);
    Manifold& m = q.out.emplace_back();
    m.n = r.n;
    m.owner = r.on_own_face ? NormalOwner::kA : NormalOwner::kNone;
    m.sub_key = r.key;
    m.count = count;
    for (int i = 0; i < count; ++i) {
        const Candidate& c = r.points[static_cast<std::size_t>(i)];
        m.points[i] = {c.foot, c.core, r.on_own_face ? 0 : c.radius, 0, c.separation, c.feature};
    }
}

}  // namespace

NarrowResult collide_solid_with_mesh(Query& q, const TriangleMesh& mesh, const std::vector<int>& triangles) {
    thread_local Scratch s;
    gather(q, mesh, triangles, s);
    bool sound = true;
    for (std::size_t i = 0; i < s.region_count; ++i) {
        Region& r = s.regions[i];
        for (const int t : r.triangles) clip_to_triangle(q, mesh, t, r);
        if (is_proven(q, mesh, r)) continue;
        r.points.clear();
        for (const int t : r.triangles) sound = examine(q, mesh, t, r, s) && sound;
    }
    if (!sound && s.region_count == 1 && s.ridge_count == 0 && s.regions[0].points.empty()) return failed(q);
    for (std::size_t i = 0; i < s.region_count; ++i)
        if (!s.regions[i].points.empty()) add_region_manifold(q, s.regions[i]);
    for (std::size_t i = 0; i < s.ridge_count; ++i) add_ridge_manifold(q, s.ridges[i]);
    return NarrowResult::kTouching;
}

}  // namespace cairn::narrow
