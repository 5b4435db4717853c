// Two boxes: FCL's separating axis test gives the direction, on boxes grown a little if they do not overlap.
#include "collision/narrow_pair.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

using fcl_query::Answer;
using fcl_query::BoxHit;

constexpr Real kSkin = 5e-3;      // of the size: growth of each box in the second try
constexpr Real kThinSkin = 5e-6;  // and in the third

Answer grown(Query& q, Real skin, BoxHit& hit) {
    ++q.stats.fcl_calls;
    const Vec3 grow = Vec3::Constant(skin);
    return fcl_query::box_box(q.a.X_WS, q.a.shape->half_extents + grow, q.b.X_WS, q.b.shape->half_extents + grow, hit);
}

}  // namespace

NarrowResult collide_boxes(Query& q) {
    NarrowResult result;
    if (try_last_contact(q, result)) return result;
    BoxHit hit;
    Answer answer = grown(q, 0, hit);
    if (answer == Answer::kApart) {
        // Disjoint boxes. Grown ones may choose a direction along which the boxes themselves overlap (edges must beat faces clearly):
        // then less growth tells better.
        for (const Real skin : {kSkin, kThinSkin}) {
            answer = grown(q, skin * q.size, hit);
            if (answer != Answer::kContact || separation_along(q, hit.n) >= 0) break;
        }
    }
    if (answer == Answer::kFailed) return failed(q);
    if (answer == Answer::kContact && try_manifold(q, hit.n, result)) return result;
    return collide_cores(q);  // farther apart, or corner to corner
}

NarrowResult collide_capsule_box(Query& q) {
    // Where both ends of the axis lie over the same face the nearer one is nearest, and the normal the face's.
    const AxisSegment axis = axis_segment(q.a, Vec3::UnitZ());
    const Vec3& h = q.b.shape->half_extents;
    const Vec3 p = q.b.X_WS.to_local(axis.end[0]), r = q.b.X_WS.to_local(axis.end[1]);
    int outside = 0, k = 0;
    for (int i = 0; i < 3; ++i) {
        if (std::abs(p[i]) <= h[i] && std::abs(r[i]) <= h[i]) continue;
        ++outside;
        k = i;
    }
    const bool over_face = outside == 1 && std::min(std::abs(p[k]), std::abs(r[k])) > h[k] && p[k] * r[k] > 0;
    if (!over_face) return collide_convex(q);

    ++q.stats.fcl_calls;
    const Real reach = q.a.shape->radius + q.margin;
    fcl_query::PointHit hit;
    const bool first = std::abs(p[k]) < std::abs(r[k]);
    const Vec3 normal = p[k] > 0 ? Vec3(q.b.X_WS.R.col(k)) : Vec3(-q.b.X_WS.R.col(k));
    const Answer answer = fcl_query::point_box(axis.end[first ? 0 : 1], q.b.X_WS, h, reach, hit);
    if (answer == Answer::kFailed) return failed(q);
    if (answer == Answer::kApart || hit.distance >= reach) return separated(q, normal);
    if (hit.n.dot(normal) < 1 - 1e-9) return collide_convex(q);
    Face face;
    face_towards(q.b, normal, face);
    Candidate candidates[kMaxCandidates];
    const int count = face_candidates(q.a, face, q.margin, q.size, candidates);
    if (count == 0) return separated(q, normal);
    add_face_manifold(q, normal, true, candidates, count);
    return NarrowResult::kTouching;
}

}  // namespace cairn::narrow
