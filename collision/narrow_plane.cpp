// Anything bounded against a half-space. Its normal is given, FCL says how deep the deepest point lies; the other points follow from it.
#include "collision/narrow_pair.hpp"

#include "collision/hull.hpp"

namespace cairn::narrow {
namespace {

constexpr Real kNearby = 0.02;  // of the size: vertices besides those of the lowest face count up to this height

// Vertices of a box or hull: those of the lowest face, and whatever else is near.
int vertex_candidates(const PlacedShape& s, const Face& plane, Real margin, Real size, Candidate out[kMaxCandidates]) {
    Face lowest;
    lowest_face(s, -plane.normal, lowest);
    const bool is_box = s.shape->type == ShapeType::kBox;
    const int total = is_box ? 8 : static_cast<int>(s.shape->hull->vertices().size());
    const Real near = std::min(margin, kNearby * size);
    int count = 0;
    for (int i = 0; i < total && count < kMaxCandidates; ++i) {
        Vec3 p;
        if (is_box) {
            const Vec3& h = s.shape->half_extents;
            p = s.X_WS * Vec3(i & 1 ? h.x() : -h.x(), i & 2 ? h.y() : -h.y(), i & 4 ? h.z() : -h.z());
        } else {
            p = s.X_WS * s.shape->hull->vertices()[i];
        }
        const Real height = plane.normal.dot(p) - plane.offset;
        if (height >= margin) continue;
        if (height >= near && lowest.normal.dot(p) < lowest.offset - 1e-9 * size) continue;
        out[count++] = {p, p - height * plane.normal, 0, height, static_cast<std::uint32_t>(i + 1)};
    }
    return count;
}

}  // namespace

NarrowResult collide_with_plane(Query& q) {
    q.may_cache = false;
    Face plane;
    plane.normal = q.b.X_WS.R * q.b.shape->normal;
    plane.offset = q.b.shape->offset + plane.normal.dot(q.b.X_WS.p);
    const Real lowest = -support(q.a, -plane.normal) - plane.offset;
    if (lowest >= q.margin) return NarrowResult::kSeparated;

    ++q.stats.fcl_calls;
    fcl_query::PointHit hit;
    const Vec3 deepest = support_point(q.a, -plane.normal);
    const Real reach = q.margin + q.size + std::abs(lowest);
    if (fcl_query::point_half_space(deepest, plane.normal, plane.offset, reach, hit) != fcl_query::Answer::kContact) return failed(q);
    plane.normal = hit.n;

    const ShapeType type = q.a.shape->type;
    Candidate candidates[kMaxCandidates];
    const int count = type == ShapeType::kBox || type == ShapeType::kHull ? vertex_candidates(q.a, plane, q.margin, q.size, candidates)
                                                                          : face_candidates(q.a, plane, q.margin, q.size, candidates);
    if (count == 0) return NarrowResult::kSeparated;
    add_face_manifold(q, plane.normal, true, candidates, count);
    return NarrowResult::kTouching;
}

}  // namespace cairn::narrow
