// Stage 2: brings each contact up to date, cheapest way first: nobody awake → as it was; relative pose unchanged → reuse; else the narrow
// phase.
#include "engine/reach.hpp"
#include "engine/world_data.hpp"

#include <algorithm>

namespace cairn {
namespace {

void count_query(StepProfile& profile, ShapeType a, ShapeType b, std::uint64_t fcl_calls) {
    const int low = static_cast<int>(std::min(a, b)), high = static_cast<int>(std::max(a, b));
    ++profile.queries_of[low][high];
    profile.fcl_calls_of[low][high] += static_cast<std::uint32_t>(fcl_calls);
}

void ask_narrow_phase(WorldData& world, Contact& c, const Transform& X_WA, const Transform& X_WB, const Transform& X_AB, Real margin,
                      NarrowStats& stats) {
    const ShapeRecord &a = world.shapes[c.shape_a], &b = world.shapes[c.shape_b];
    world.fresh.clear();
    // Asked with some to spare, so that a reach that grows by a hair does not end the reuse.
    margin *= 1.25;
    const std::uint64_t calls_before = stats.fcl_calls;
    const NarrowResult result = collide_shapes({&a.shape, X_WA * a.X_BS}, {&b.shape, X_WB * b.X_BS}, margin, c.cache, world.fresh, stats);
    if (world.clock.on()) count_query(world.clock.profile(), a.shape.type, b.shape.type, stats.fcl_calls - calls_before);
    if (result == NarrowResult::kFailed) {  // the last manifold stays, at the present poses
        ContactStore::refresh(c, X_WA, X_WB);
        return;
    }
    ContactStore::replace(c, world.fresh.data(), static_cast<int>(world.fresh.size()), X_WA, X_WB);
    c.X_AB_query = X_AB;
    c.query_margin = margin;
    c.fresh = false;
}

void count_contact(const Contact& c, StepReport& report) {
    for (int i = 0; i < c.manifold_count; ++i) {
        const CachedManifold& m = c.manifold(i);
        report.manifolds += m.count > 0;
        report.contacts += static_cast<std::uint32_t>(m.count);
        for (int k = 0; k < m.count; ++k) report.max_penetration = std::max(report.max_penetration, -m.points[k].separation);
    }
}

}  // namespace

void update_contacts(WorldData& world, Real dt, StepReport& report) {
    NarrowStats stats;
    refresh_active(world);
    for (const std::uint32_t slot : world.active.contacts.numbers()) {
        Contact& c = world.contacts.slots()[slot];
        const Body &a = world.bodies[c.body_a], &b = world.bodies[c.body_b];
        if (is_moving(a) || is_moving(b) || c.fresh) {
            const Transform X_WA = a.transform(), X_WB = b.transform();
            const Transform X_AB(X_WA.R.transpose() * X_WB.R, X_WA.to_local(X_WB.p));
            const Real margin = pair_margin(world, a, world.shapes[c.shape_a], b, world.shapes[c.shape_b], dt);
            if (ContactStore::is_reusable(c, X_AB, margin)) {
                ContactStore::refresh(c, X_WA, X_WB);
                ++report.manifolds_reused;
            } else {
                ask_narrow_phase(world, c, X_WA, X_WB, X_AB, margin, stats);
            }
        } else {
            world.active.has_stopped = true;
        }
        count_contact(c, report);
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
