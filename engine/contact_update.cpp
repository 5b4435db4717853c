// Stage 2: brings each contact up to date, cheapest way first: nobody awake → as it was; boxes too far apart → nothing; relative pose
// unchanged → reuse; else the narrow phase.
#include "engine/reach.hpp"
#include "engine/world_data.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

// Manifolds are asked for with some margin to spare, so that a reach that grows by a hair does not end their reuse.
constexpr Real kSpare = 1.25;

void count_query(StepProfile& profile, ShapeType a, ShapeType b, std::uint64_t fcl_calls) {
    const int low = static_cast<int>(std::min(a, b)), high = static_cast<int>(std::max(a, b));
    ++profile.queries_of[low][high];
    profile.fcl_calls_of[low][high] += static_cast<std::uint32_t>(fcl_calls);
}

Transform relative_pose(const Transform& X_WA, const Transform& X_WB) {
    return {X_WA.R.transpose() * X_WB.R, X_WA.to_local(X_WB.p)};
}

void ask_narrow_phase(WorldData& world, Contact& c, const Transform& X_WA, const Transform& X_WB, Real margin, NarrowStats& stats) {
    const ShapeRecord &a = world.shapes[c.shape_a], &b = world.shapes[c.shape_b];
    world.fresh.clear();
    const std::uint64_t calls_before = stats.fcl_calls;
    const NarrowResult result = collide_shapes({&a.shape, X_WA * a.X_BS}, {&b.shape, X_WB * b.X_BS}, margin, c.cache, world.fresh, stats);
    if (world.clock.on()) count_query(world.clock.profile(), a.shape.type, b.shape.type, stats.fcl_calls - calls_before);
    if (result == NarrowResult::kFailed) {  // the last manifold stays, at the present poses
        ContactStore::refresh(c, X_WA, X_WB);
        return;
    }
    ContactStore::replace(c, world.fresh.data(), static_cast<int>(world.fresh.size()), X_WA, X_WB);
    if (c.manifold_count > 0) c.X_AB_query = relative_pose(X_WA, X_WB);
    c.query_margin = margin;
    c.fresh = false;
}

// Whether the boxes of two shapes, or balls around them, are that far apart: then so are the shapes.
bool are_apart(const ShapeMotion& a, const ShapeMotion& b, Real margin) {
    const Vec3 gap = (a.tight.lo - b.tight.hi).cwiseMax(b.tight.lo - a.tight.hi);
    if (gap.maxCoeff() >= margin) return true;
    const Vec3 between = 0.5 * ((a.tight.lo + a.tight.hi) - (b.tight.lo + b.tight.hi));
    const Real reach = a.ball + b.ball + margin;
    return between.squaredNorm() >= reach * reach;  // false where there is no ball
}

const ShapeMotion& motion_of(WorldData& world, std::uint32_t shape, std::uint32_t body, Real dt) {
    const ShapeMotion& motion = world.motions[shape];
    if (motion.step != world.motion_step && motion.step != ShapeMotion::kStatic) note_motion(world, world.bodies[body], dt);
    return motion;
}

// Says whether any of it moves.
bool update_contact(WorldData& world, Contact& c, Real dt, NarrowStats& stats, StepReport& report) {
    Body &a = world.bodies[c.body_a], &b = world.bodies[c.body_b];
    if (!c.fresh && !may_move(a) && !may_move(b)) {
        report.manifolds_reused += static_cast<std::uint32_t>(c.manifold_count);
        return is_moving(a) || is_moving(b);
    }
    if (c.held) c.held = a.stands = b.stands = false;
    const ShapeMotion &motion_a = motion_of(world, c.shape_a, c.body_a, dt), &motion_b = motion_of(world, c.shape_b, c.body_b, dt);
    const Real margin = pair_margin(motion_a, motion_b, dt), wide_margin = kSpare * margin;
    if (are_apart(motion_a, motion_b, wide_margin)) {
        ContactStore::clear(c);
        c.fresh = false;
        return true;
    }
    const Transform X_WA = a.transform(), X_WB = b.transform();
    if (ContactStore::always_holds(c) ||
        (ContactStore::may_be_reusable(c, margin) && ContactStore::is_reusable(c, relative_pose(X_WA, X_WB), margin))) {
        ContactStore::refresh(c, X_WA, X_WB);
        ++report.manifolds_reused;
    } else {
        ask_narrow_phase(world, c, X_WA, X_WB, wide_margin, stats);
    }
    return true;
}

}  // namespace

void note_motion(WorldData& world, const Body& body, Real dt) {
    const Transform X_WB = body.transform();
    const bool moves = is_moving(body);
    for (std::uint32_t s = body.shape_begin; s < body.shape_begin + body.shape_count; ++s) {
        const ShapeRecord& record = world.shapes[s];
        ShapeMotion& motion = world.motions[s];
        motion.v = body.v;
        motion.reach = reach_without_way(world, body, record, dt);
        motion.moves = moves;
        motion.step = body.type == BodyType::kStatic ? ShapeMotion::kStatic : world.motion_step;
        if (record.shape.type != ShapeType::kPlane) {
            motion.tight = shape_aabb(record.shape, X_WB * record.X_BS);
        } else {
            motion.tight.hi = Vec3::Constant(std::numeric_limits<Real>::infinity());
            motion.tight.lo = -motion.tight.hi;
        }
    }
}

void update_contacts(WorldData& world, Real dt, StepReport& report) {
    NarrowStats stats;
    refresh_active(world);
    if (++world.motion_step == ShapeMotion::kStatic) world.motion_step = 0;
    std::vector<Contact>& contacts = world.contacts.slots();
    const std::vector<std::uint32_t>& slots = world.active.contacts.numbers();
    for (std::size_t k = 0; k < slots.size(); ++k) {
        if (k + kPrefetchAhead < slots.size()) prefetch_manifold(contacts[slots[k + kPrefetchAhead]]);
        Contact& c = contacts[slots[k]];
        if (!update_contact(world, c, dt, stats, report)) world.active.has_stopped = true;
        report.manifolds += static_cast<std::uint32_t>(c.manifold_count);
        report.contacts += static_cast<std::uint32_t>(c.point_count);
        report.max_penetration = std::max(report.max_penetration, c.deepest);
    }
    report.manifolds += world.active.quiet_manifolds;
    report.contacts += world.active.quiet_points;
    report.narrow_queries = stats.queries;
    report.fcl_calls = stats.fcl_calls;
    report.fcl_failures = stats.failures;
    if (world.clock.on()) world.clock.profile().separating_axis_hits = static_cast<std::uint32_t>(stats.separating_axis_hits);
    world.clock.lap(Phase::kNarrowPhase);
}

}  // namespace cairn
