// The general pair: FCL's GJK on cores drawn in from the surfaces, its expanding polytope where the cores overlap or do not tell.
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
constexpr Real kTolerance = 1e-8;  // of the size

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

Answer closest_cores(Query& q, Real shrink, const Vec3& toward_a, Closest& closest) {
    ++q.stats.fcl_calls;
    Core a, b;
    make_core(q.a, shrink, a);
    make_core(q.b, shrink, b);
    return fcl_query::gjk(a, b, toward_a, kTolerance * q.size, closest);
}

// Overlapping: the expanding polytope, and the portal method should it give up.
// Returns kApart if they turn out not to overlap.
Answer offer_penetration(Query& q, Found& best) {
    ++q.stats.fcl_calls;
    Core a, b;
    make_core(q.a, 0, a);
    make_core(q.b, 0, b);
    Vec3 n;
    const Vec3 guess = best.exists ? best.n : q.axis;
    const Answer answer = fcl_query::epa(a, b, guess, 1e-6 * q.size, n);
    if (answer == Answer::kContact) offer(q, best, n);
    if (answer == Answer::kApart || (best.exists && best.along > -0.5 * q.size)) return answer;
    ++q.stats.fcl_calls;
    Vec3 towards = best.exists ? best.n : Vec3(centre_of(q.a) - centre_of(q.b));
    const Real length = towards.norm();
    towards = length > 0 ? Vec3(towards / length) : Vec3::UnitZ();
    if (fcl_query::mpr(a, b, towards, 1e-6 * q.size, n) == Answer::kContact) offer(q, best, n);
    return answer;
}

// A direction whose features do not show: one point where the cores came closest, brought out to the surfaces along n.
NarrowResult add_bare_point(Query& q, const Vec3& n, const Vec3& near_a) {
    const Vec3 on_a = near_a - (n.dot(near_a) + support(q.a, -n)) * n;
    const Vec3 on_b = near_a - (n.dot(near_a) - support(q.b, n)) * n;
    return add_point(q, n, NormalOwner::kNone, on_a, 0, on_b, 0, 1);
}

}  // namespace

NarrowResult collide_convex(Query& q) {
    Found best;
    Vec3 near_a = centre_of(q.a);
    NarrowResult result;
    // Cores ever nearer to the shapes; at last the shapes themselves, if they are apart.
    for (const Real shrink : {kFar, kNear, 0.0}) {
        if (shrink == 0.0 && best.exists && best.along <= 0) break;
        Closest closest;
        const Answer answer = closest_cores(q, shrink, best.exists ? best.n : q.axis, closest);
        if (answer == Answer::kFailed) continue;
        if (answer == Answer::kContact) break;
        offer(q, best, closest.n);
        if (best.along >= q.margin) return separated(q, best.n);
        near_a = closest.a;
        offer_faces(q, best);
        if (try_manifold(q, best.n, result)) return result;
    }
    if (!best.exists || best.along < 0) {
        const Answer answer = offer_penetration(q, best);
        near_a = support_point(q.a, -best.n);
        Closest closest;
        if (answer == Answer::kApart && closest_cores(q, 0, best.exists ? best.n : q.axis, closest) == Answer::kApart) {
            offer(q, best, closest.n);
            near_a = closest.a;
        }
        if (!best.exists) return failed(q);
        if (try_manifold(q, best.n, result)) return result;
    }
    return add_bare_point(q, best.n, near_a);
}

}  // namespace cairn::narrow
