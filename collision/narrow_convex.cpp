// The general pair: FCL's GJK on cores drawn in from the surfaces, unless FCL's segments show that edges still are nearest; where the cores
// overlap or do not tell, a descent to the least penetration.
#include "collision/core_features.hpp"
#include "collision/hull.hpp"
#include "collision/narrow_pair.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

using fcl_query::Answer;
using fcl_query::Closest;
using fcl_query::Core;

// How far the cores are drawn in, of the inner radii: far first (resting contacts), then near, for corners that the far ones round off.
constexpr Real kFar = 0.05;
constexpr Real kNear = 0.002;
constexpr Real kDeep = 0.01;  // of the size: overlaps that may have a shorter way out elsewhere
constexpr int kMaxDescents = 8;

struct Found {
    Vec3 n = Vec3::Zero();
    Real along = 0;  // separation along n
    bool exists = false;
};

void offer(const Query& q, Found& best, const Vec3& n) {
    const Real along = separation_along(q, n);
    if (std::isfinite(along) && (!best.exists || along > best.along)) best = {n, along, true};
}

// Face normals near the best direction, which a diagonal between two corners of the cores may have missed.
void offer_faces(const Query& q, Found& best) {
    const Vec3 n = best.n;
    Vec3 normal;
    if (face_normal_towards(q.a, -n, normal)) offer(q, best, -normal);
    if (face_normal_towards(q.b, n, normal)) offer(q, best, normal);
}

// All faces, for shapes that are deep in each other: what is nearest there need not be least.
void offer_all_faces(const Query& q, Found& best) {
    for (const PlacedShape* s : {&q.a, &q.b}) {
        const Real sign = s == &q.a ? -1 : 1;
        if (s->shape->type == ShapeType::kHull) {
            for (const ConvexHull::Face& f : s->shape->hull->faces()) offer(q, best, sign * (s->X_WS.R * f.normal));
        } else if (s->shape->type == ShapeType::kBox) {
            for (int k = 0; k < 3; ++k) {
                offer(q, best, s->X_WS.R.col(k));
                offer(q, best, -s->X_WS.R.col(k));
            }
        }
    }
}

// Whether edges of the cores are what is nearest, as they were along `last`. Proof: planes through the two closest points, across the line
// between them, have the cores on their far sides.
bool edges_are_closest(Query& q, const Core& a, const Core& b, const Vec3& last, Closest& closest) {
    constexpr Real kLeast = 1e-4, kTolerance = 1e-9;  // of the size
    AxisSegment edge_a, edge_b;
    if (!core_edge(q.a, a, last, edge_a) || !core_edge(q.b, b, -last, edge_b)) return false;
    ++q.stats.fcl_calls;
    if (!closest_of_segments(edge_a, edge_b, kLeast * q.size, closest)) return false;
    return -core_support(q.a, a, -closest.n) - core_support(q.b, b, closest.n) >= closest.distance - kTolerance * q.size;
}

Answer closest_cores(Query& q, Real shrink, const Vec3& toward_a, Closest& closest) {
    Core a, b;
    make_core(q.a, shrink, a);
    make_core(q.b, shrink, b);
    const bool may_be_edges = q.was_touching && (shrink == kFar || a.kind == Core::Kind::kSegment);
    if (may_be_edges && edges_are_closest(q, a, b, toward_a, closest)) return Answer::kApart;
    ++q.stats.fcl_calls;
    return fcl_query::gjk(a, b, toward_a, q.size, closest);
}

// Down to a direction of locally least penetration: A moved out along n until it is just clear of B is nearest to the face of A − B through
// which it left, and that face's normal is a way out at least as short.
void descend(Query& q, Found& found) {
    Core a, b;
    make_core(q.a, 0, a);
    make_core(q.b, 0, b);
    const Vec3 start = a.p;
    for (int i = 0; i < kMaxDescents; ++i) {
        const Real depth = -found.along;
        if (depth <= 0) return;
        a.p = start + (depth + 1e-3 * q.size + 0.02 * depth) * found.n;
        ++q.stats.fcl_calls;
        Closest closest;
        if (fcl_query::gjk(a, b, found.n, q.size, closest) != Answer::kApart) return;
        Found next;
        offer(q, next, closest.n);
        if (!next.exists || next.along <= found.along + 1e-4 * depth) return;
        found = next;
    }
}

// Overlapping: descents from where the portal leads that faces along the guess, and from the best of the guess and the shapes' own axes.
void offer_penetration(Query& q, Found& best) {
    Vec3 between = centre_of(q.a) - centre_of(q.b);
    const Real length = between.norm();
    between = length > 1e-6 * q.size ? Vec3(between / length) : Vec3::UnitZ();
    const Vec3 guess = best.exists ? best.n : between;

    ++q.stats.fcl_calls;
    Core a, b;
    make_core(q.a, 0, a);
    make_core(q.b, 0, b);
    Vec3 n;
    Found starts[2];
    if (fcl_query::mpr(a, b, guess, q.size, n) == Answer::kContact) offer(q, starts[0], n);
    offer(q, starts[1], guess);
    offer_faces(q, starts[1]);
    offer_all_faces(q, starts[1]);
    for (const PlacedShape* s : {&q.a, &q.b}) {
        for (int k = 0; k < 3; ++k) {
            for (const Real sign : {1.0, -1.0}) {
                Found along_axis;
                offer(q, along_axis, sign * s->X_WS.R.col(k));
                offer_faces(q, along_axis);
                offer(q, starts[1], along_axis.n);
            }
        }
    }
    for (Found& start : starts) {
        if (!start.exists) continue;
        descend(q, start);
        offer(q, best, start.n);
    }
}

// A direction whose features do not show: one point where the cores came closest, brought out to the surfaces along n.
NarrowResult add_bare_point(Query& q, const Vec3& n, const Vec3& near_a) {
    const Vec3 on_a = near_a - (n.dot(near_a) + support(q.a, -n)) * n;
    const Vec3 on_b = near_a - (n.dot(near_a) - support(q.b, n)) * n;
    return add_point(q, n, NormalOwner::kNone, on_a, 0, on_b, 0, 1);
}

}  // namespace

NarrowResult collide_convex(Query& q) {
    NarrowResult result;
    return try_last_contact(q, result) ? result : collide_cores(q);
}

NarrowResult collide_cores(Query& q) {
    NarrowResult result;
    Found best;
    Vec3 near_a = centre_of(q.a);
    // Cores ever nearer to the shapes; at last the shapes themselves, if they are apart. A capsule's axis lies deep enough as it is: the
    // direction from the whole other shape to it is exact.
    const bool capsule = q.a.shape->type == ShapeType::kCapsule;
    for (const Real shrink : {kFar, kNear, 0.0}) {
        if (capsule ? shrink > 0 : shrink == 0 && best.exists && best.along <= 0) continue;
        Closest closest;
        const Answer answer = closest_cores(q, shrink, best.exists ? best.n : q.axis, closest);
        if (answer == Answer::kFailed) continue;
        if (answer == Answer::kContact) break;
        offer(q, best, closest.n);
        if (best.along >= q.margin) return separated(q, best.n);
        near_a = closest.a;
        offer_faces(q, best);
        if (!capsule && best.along < -kDeep * q.size) break;
        if (try_manifold(q, best.n, result)) return result;
    }
    if (!best.exists || best.along < 0) {
        offer_penetration(q, best);
        if (!best.exists) return failed(q);
        near_a = support_point(q.a, -best.n);
        if (try_manifold(q, best.n, result)) return result;
        // Hardly overlapping after all, or not at all.
        Closest closest;
        if (closest_cores(q, 0, best.n, closest) == Answer::kApart) {
            offer(q, best, closest.n);
            near_a = closest.a;
            if (try_manifold(q, best.n, result)) return result;
        }
    }
    return add_bare_point(q, best.n, near_a);
}

}  // namespace cairn::narrow
