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
constexpr Real kSlack = 1e-5;      // of the size: by which a shape may lie beside a triangle and yet over it
constexpr Real kBeside = 0.01;     // [rad] from a triangle's normal that is as good as it

struct Region {
    Vec3 normal;
    Real offset = 0;
    Real lowest = 0;    // separation of the shape from the plane
    Candidate deepest;  // of the points
    bool is_proven = false;
    int deepest_on = -1;    // and its triangle; −1: no points
    int own = -1;           // place in Scratch::faces of the shape's face that comes down on it; −1: none does
    std::vector<int> near;  // its triangles, as places in Scratch::near
    std::vector<Candidate> points;
};

// A triangle that the shape may touch.
struct NearTriangle {
    int triangle = 0;
    Vec3 side[3];              // outward unit normals of its sides, in its plane
    bool may_be_under = true;  // parts of the shape may lie over it
    int beyond = -1;           // the neighbour across the edge that the whole shape lies beyond; −1: there is none
    bool is_left = false;      // what touches it belongs to a neighbour
    bool has_points = false;   // the shape's lowest feature lies over it
    bool is_covered = false;   // its ridges need not be examined, since all neighbours across them are
    bool is_asked = false;     // its ridges have to be examined, since a neighbour is not
};

// Contacts with the mesh's ridges that share a normal.
struct Ridge {
    Vec3 n;
    bool on_own_face = false;  // n is that of a face of the shape
    std::uint32_t key = 0;
    std::vector<Candidate> points;  // core on the mesh, foot on the shape
};

// What tells regions apart, close together in memory.
struct Plane {
    Vec3 normal;
    Real offset;
};

struct Scratch {
    std::vector<NearTriangle> near;
    std::vector<Face> faces;    // of the shape, that come down on something
    std::vector<Plane> planes;  // of the regions
    std::vector<Region> regions;
    std::vector<Ridge> ridges;
    std::size_t region_count = 0;
    std::size_t ridge_count = 0;
    std::size_t face_count = 0;

    Region& new_region() {
        if (region_count == regions.size()) regions.emplace_back();
        Region& r = regions[region_count++];
        r.near.clear();
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

Vec3 middle(const TriangleMesh::Triangle& t) {
    return (t.corner[0] + t.corner[1] + t.corner[2]) / 3;
}

// Triangles beyond the shape's extent along its own axes are out of reach.
bool misses(const SolidReach& reach, const TriangleMesh::Triangle& t) {
    const Vec3 a = reach.to_local * t.corner[0], b = reach.to_local * t.corner[1], c = reach.to_local * t.corner[2];
    return (a.cwiseMin(b).cwiseMin(c).array() >= reach.hi.array()).any() || (a.cwiseMax(b).cwiseMax(c).array() <= reach.lo.array()).any();
}

// Where the shape lies beside a triangle, seen along its normal. False if it is out of reach: along the line from its centre to a near
// point of the triangle, or along the triangle's plane.
bool look_beside(const Query& q, const TriangleMesh::Triangle& triangle, const Vec3& centre, Real inside, NearTriangle& near) {
    const auto& v = triangle.corner;
    Vec3* const out = near.side;
    Real beyond[3];  // the centre's distance beyond each side
    bool all_over = true;
    for (int k = 0; k < 3; ++k) {
        out[k] = (v[(k + 1) % 3] - v[k]).cross(triangle.normal);
        beyond[k] = out[k].dot(centre - v[k]);
        all_over = all_over && (beyond[k] <= 0 || beyond[k] * beyond[k] <= inside * inside * out[k].squaredNorm());
    }
    int farthest = 0;
    for (int k = 0; k < 3; ++k) {
        const Real length = out[k].norm();
        out[k] /= length;
        beyond[k] /= length;
        if (beyond[k] > beyond[farthest]) farthest = k;
    }
    if (all_over) return true;

    const Vec3& from = v[farthest];
    const Vec3 edge = v[(farthest + 1) % 3] - from;
    const Vec3 to_edge = from + std::clamp(edge.dot(centre - from) / edge.squaredNorm(), 0.0, 1.0) * edge - centre;
    const Vec3 u = to_edge.normalized();
    if (std::min({u.dot(v[0]), u.dot(v[1]), u.dot(v[2])}) - support(q.a, u) >= q.margin) return false;

    Real most = kSlack * q.size;
    for (int k = 0; k < 3; ++k) {
        if (beyond[k] <= inside) continue;
        const Real apart = -support(q.a, -out[k]) - out[k].dot(v[k]);
        if (apart >= q.margin) return false;
        if (apart <= most) continue;
        most = apart;
        near.may_be_under = false;
        near.beyond = triangle.neighbour[k];
    }
    return true;
}

// Whether what the shape may touch of a triangle belongs to a neighbour that it lies over, too: it lies beyond an edge, and then beyond the
// next, until it comes to lie over one. (Around a summit it may lie beyond an edge of each.)
bool is_left_to_neighbour(const Scratch& s, std::size_t i) {
    for (std::size_t step = 0; step < s.near.size(); ++step) {
        if (s.near[i].beyond < 0) return step > 0;
        const auto next = std::find_if(s.near.begin(), s.near.end(), [&](const NearTriangle& n) { return n.triangle == s.near[i].beyond; });
        if (next == s.near.end()) return false;
        i = static_cast<std::size_t>(next - s.near.begin());
    }
    return false;
}

// The place of a triangle in s.near, whose triangles ascend; −1: it is out of reach.
int place_of(const Scratch& s, int triangle) {
    const auto found =
        std::lower_bound(s.near.begin(), s.near.end(), triangle, [](const NearTriangle& n, int t) { return n.triangle < t; });
    return found != s.near.end() && found->triangle == triangle ? static_cast<int>(found - s.near.begin()) : -1;
}

// The place in s.faces of the face that comes down along a normal, built when first asked for.
int own_face_towards(const Query& q, const Vec3& normal, Scratch& s) {
    if (q.a.shape->type == ShapeType::kCapsule) return -1;
    const int index = lowest_face_index(q.a, -normal);
    for (std::size_t i = 0; i < s.face_count && index >= 0; ++i)
        if (s.faces[i].index == index) return static_cast<int>(i);
    if (s.face_count == s.faces.size()) s.faces.emplace_back();
    Face& face = s.faces[s.face_count];
    if (!comes_down_flat(q.a, normal, face)) return -1;
    face.disc_radius = 0;  // a disc's four rim points may come to lie over different triangles: here it is its outline
    return static_cast<int>(s.face_count++);
}

// The region of a triangle with this plane, a new one where there is none.
Region& region_of(const Query& q, const Vec3& n, Real offset, const Vec3& middle, Scratch& s) {
    const auto same = [&](const Plane& p) {
        return std::abs(p.normal.x() - n.x()) < kOneNormal && (p.normal - n).squaredNorm() < kOneNormal * kOneNormal &&
               std::abs(p.normal.dot(middle) - p.offset) < kOnePlane * q.size;
    };
    const auto found = std::find_if(s.planes.begin(), s.planes.end(), same);
    if (found != s.planes.end()) return s.regions[static_cast<std::size_t>(found - s.planes.begin())];
    s.planes.push_back({n, offset});
    Region& r = s.new_region();
    r.normal = n;
    r.offset = offset;
    r.own = own_face_towards(q, n, s);
    return r;
}

// Sorts the triangles that the shape may touch from the front into planes.
void gather(const Query& q, const TriangleMesh& mesh, const SolidReach& reach, const std::vector<int>& triangles, Scratch& s) {
    s.region_count = s.ridge_count = s.face_count = 0;
    s.near.clear();
    s.planes.clear();
    const Vec3 centre = centre_of(q.a);
    const Real inside = inner_radius(*q.a.shape);
    for (const int t : triangles) {
        const TriangleMesh::Triangle& triangle = mesh.triangle(t);
        if (misses(reach, triangle)) continue;
        const Vec3& n = triangle.normal;
        const Real offset = n.dot(triangle.corner[0]);
        const Real lowest = -support(q.a, -n) - offset;
        if (lowest >= q.margin) continue;
        NearTriangle near;
        near.triangle = t;
        if (!look_beside(q, triangle, centre, inside, near)) continue;
        if (n.dot(centre) < offset && support(q.a, n) < offset) continue;
        Region& r = region_of(q, n, offset, middle(triangle), s);
        if (r.near.empty()) r.lowest = lowest;
        r.near.push_back(static_cast<int>(s.near.size()));
        s.near.push_back(near);
    }
}

bool add_distinct(std::vector<Candidate>& points, const Candidate& c, Real size) {
    for (const Candidate& p : points)
        if (p.feature == c.feature || (p.core - c.core).squaredNorm() < 1e-14 * size * size) return false;
    points.push_back(c);
    return true;
}

// The shape's lowest feature over one triangle of a region. What is cut off by an edge inside the region goes on in the next triangle.
void clip_to_triangle(const Query& q, const TriangleMesh& mesh, const NearTriangle& near, Region& region, const Scratch& s) {
    const int t = near.triangle;
    Face face;
    triangle_face(mesh, t, face);
    face.side = near.side;
    face.normal = region.normal;
    face.offset = region.offset;
    Candidate found[kMaxCandidates];
    const int count = region.own >= 0 ? flat_candidates(s.faces[static_cast<std::size_t>(region.own)], face, q.margin, q.size, found)
                                      : face_candidates(q.a, face, q.margin, q.size, found);
    const auto inner = [&](int k) { return mesh.bend(t, k) == TriangleMesh::Bend::kNone; };
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
            c.feature = 0x80000000u | static_cast<std::uint32_t>(mesh.triangle(t).vertex[corner]);
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
    const auto& corner = mesh.triangle(r.deepest_on).corner;
    ++q.stats.fcl_calls;
    Vec3 nearest;
    return fcl_query::nearest_on_triangle(r.deepest.core, corner[0], corner[1], corner[2], nearest) != 0 &&
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
            corner ? static_cast<std::uint32_t>(mesh.triangle(t).vertex[out])
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
    const auto& corner = mesh.triangle(t).corner;
    const Real top = std::max({n.dot(corner[0]), n.dot(corner[1]), n.dot(corner[2])});
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

bool has_ridge(const TriangleMesh& mesh, int t) {
    using Bend = TriangleMesh::Bend;
    return mesh.bend(t, 0) == Bend::kRidge || mesh.bend(t, 1) == Bend::kRidge || mesh.bend(t, 2) == Bend::kRidge;
}

OwnFace own_face(const Region& region, const Scratch& s, int t) {
    OwnFace own;
    if (region.own < 0) return own;
    own.face = &s.faces[static_cast<std::size_t>(region.own)];
    if (region.deepest_on != t) return own;
    const int in = static_cast<int>(region.deepest.feature >> 8 & 0xff), out = static_cast<int>(region.deepest.feature & 0xff);
    if ((in >= kSideBit) == (out >= kSideBit)) return own;
    own.edge = std::min(in, out);
    own.side = std::max(in, out) - kSideBit;
    return own;
}

// A triangle whose plane the shape reaches beside its lowest point. Adds what touches its ridges; whether its face touches, too.
bool touches_face(Query& q, const TriangleMesh& mesh, int t, const Region& region, Scratch& s, bool& sound) {
    // Without ridges what touches is the face, unless the shape is so deep that it may lie behind.
    const bool is_deep = region.deepest_on >= 0 && region.deepest.separation < -kFar * inner_radius(*q.a.shape);
    if (!is_deep && !has_ridge(mesh, t)) return true;
    const Vec3* const corner = mesh.triangle(t).corner.data();
    fcl_query::Closest closest;
    int corners = 7;
    const Answer answer = closest_to_triangle(q, kFar, own_face(region, s, t), corner, region.normal, closest, corners);
    sound = sound && answer != Answer::kFailed;
    if (answer != Answer::kApart) return true;
    if (closest.n.dot(region.normal) <= 0) return false;  // from behind
    const Real top = std::max({closest.n.dot(corner[0]), closest.n.dot(corner[1]), closest.n.dot(corner[2])});
    if (-support(q.a, -closest.n) - top >= q.margin) return false;
    const Verdict verdict = judge(mesh, t, corners, closest.n);
    if (verdict == Verdict::kRidge && !add_under_own_face(q, mesh, t, closest.n, s)) add_bare(q, mesh, t, corners, closest, s);
    return verdict == Verdict::kFace;
}

// A region without a point that proves its face: each triangle for itself.
void examine(Query& q, const TriangleMesh& mesh, Region& region, Scratch& s, bool& sound) {
    const bool is_single = region.near.size() == 1;  // then its points are known
    if (!is_single) region.points.clear();
    for (const int i : region.near) {
        const NearTriangle& near = s.near[static_cast<std::size_t>(i)];
        const bool face = !near.is_left && !near.is_covered && touches_face(q, mesh, near.triangle, region, s, sound);
        if (is_single && !face) region.points.clear();
        if (!is_single && face && near.may_be_under) clip_to_triangle(q, mesh, near, region, s);
    }
}

// Whether what may touch a triangle's ridges will be found from the triangles across them. Nothing else is left of a triangle that the
// shape's lowest feature does not lie over; and what is nearest on a ridge, between the normals, is nearest for both its triangles.
bool is_covered(const TriangleMesh& mesh, Scratch& s, const NearTriangle& near) {
    if (near.has_points || near.is_asked) return false;
    int across[3];
    const TriangleMesh::Triangle& t = mesh.triangle(near.triangle);
    for (int k = 0; k < 3; ++k) {
        across[k] = -1;
        if (t.bend[k] != TriangleMesh::Bend::kRidge) continue;
        if (t.neighbour[k] < 0 || t.is_sharp[k]) return false;
        across[k] = place_of(s, t.neighbour[k]);
        if (across[k] < 0) continue;
        const NearTriangle& other = s.near[static_cast<std::size_t>(across[k])];
        if (other.is_left || other.is_covered) return false;
    }
    for (const int i : across)
        if (i >= 0) s.near[static_cast<std::size_t>(i)].is_asked = true;
    return true;
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

NarrowResult collide_solid_with_mesh(Query& q, const TriangleMesh& mesh, const SolidReach& reach, const std::vector<int>& triangles) {
    thread_local Scratch s;
    gather(q, mesh, reach, triangles, s);
    bool sound = true;
    for (std::size_t i = 0; i < s.region_count; ++i) {
        Region& r = s.regions[i];
        for (const int k : r.near) {
            const NearTriangle& near = s.near[static_cast<std::size_t>(k)];
            if (near.may_be_under) clip_to_triangle(q, mesh, near, r, s);
        }
        r.is_proven = is_proven(q, mesh, r);
        for (const int k : r.near) s.near[static_cast<std::size_t>(k)].has_points = r.near.size() > 1 || r.deepest_on >= 0;
    }
    for (std::size_t i = 0; i < s.near.size(); ++i) s.near[i].is_left = is_left_to_neighbour(s, i);
    for (NearTriangle& near : s.near) near.is_covered = is_covered(mesh, s, near);
    for (std::size_t i = 0; i < s.region_count; ++i)
        if (!s.regions[i].is_proven) examine(q, mesh, s.regions[i], s, sound);
    if (!sound && s.region_count == 1 && s.ridge_count == 0 && s.regions[0].points.empty()) return failed(q);
    for (std::size_t i = 0; i < s.region_count; ++i)
        if (!s.regions[i].points.empty()) add_region_manifold(q, s.regions[i]);
    for (std::size_t i = 0; i < s.ridge_count; ++i) add_ridge_manifold(q, s.ridges[i]);
    return NarrowResult::kTouching;
}

}  // namespace cairn::narrow
