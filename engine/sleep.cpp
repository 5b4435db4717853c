// Stage 6: islands at rest fall asleep together and wake together. Only with WorldSettings::sleep.
#include "engine/world_data.hpp"

#include <algorithm>

namespace cairn {
namespace {

// An island sleeps once all its bodies have been slower than this for the time given: a fall passes these speeds within some milliseconds.
constexpr Real kSleepSpeed = 0.01;  // [m/s], of the centre and, by spin, of the farthest point
constexpr Real kSleepTime = 0.5;    // [s]

bool is_slow(const Body& b) {
    return b.v.norm() + b.w.norm() * b.radius < kSleepSpeed;
}

bool is_moving(const Body& b) {
    return b.is_awake() || (b.type == BodyType::kKinematic && b.enabled && !(b.v.isZero(0) && b.w.isZero(0)));
}

// Whether the manifolds say that the shapes touch, not merely that they are near.
bool is_touching(const Contact& c) {
    for (int i = 0; i < c.manifold_count; ++i)
        for (int k = 0; k < c.manifold(i).count; ++k)
            if (c.manifold(i).points[k].separation < 1e-3 * c.size) return true;
    return false;
}

}  // namespace

void wake_group(WorldData& world, std::uint32_t body) {
    if (!world.bodies[body].asleep) {
        world.bodies[body].rest_time = 0;
        return;
    }
    const std::uint32_t group = world.bodies[body].sleep_group;
    for (Body& b : world.bodies) {
        if (!b.asleep || b.sleep_group != group) continue;
        b.asleep = false;
        b.rest_time = 0;
    }
}

void wake_touched(WorldData& world) {
    if (!world.settings.sleep) return;
    for (bool changed = true; changed;) {  // a woken group may touch another
        changed = false;
        for (const Contact& c : world.contacts.slots()) {
            if (!c.alive || c.manifold_count == 0) continue;
            const Body &a = world.bodies[c.body_a], &b = world.bodies[c.body_b];
            if (a.asleep == b.asleep || !is_touching(c)) continue;
            if (!is_moving(a.asleep ? b : a)) continue;
            wake_group(world, a.asleep ? c.body_a : c.body_b);
            changed = true;
        }
        for (const Joint& j : world.joints) {
            if (!j.alive || j.body_a == UINT32_MAX || j.body_b == UINT32_MAX) continue;
            const Body &a = world.bodies[j.body_a], &b = world.bodies[j.body_b];
            if (a.asleep == b.asleep || !is_moving(a.asleep ? b : a)) continue;
            wake_group(world, a.asleep ? j.body_a : j.body_b);
            changed = true;
        }
    }
}

void put_to_sleep(WorldData& world, Real dt, StepReport& report) {
    if (!world.settings.sleep) return;
    const IslandBuilder& islands = world.islands;
    for (int i = 0; i < islands.count(); ++i) {
        const IndexRange range = islands.bodies(i);
        Real rested = kSleepTime;
        for (int k = range.begin; k < range.end; ++k) {
            Body& b = world.bodies[islands.body_list()[k]];
            b.rest_time = is_slow(b) ? b.rest_time + dt : 0;
            rested = std::min(rested, b.rest_time);
        }
        if (rested < kSleepTime) continue;
        for (int k = range.begin; k < range.end; ++k) {
            Body& b = world.bodies[islands.body_list()[k]];
            b.asleep = true;
            b.v.setZero();
            b.w.setZero();
            b.sleep_group = world.next_sleep_group;
        }
        ++world.next_sleep_group;
    }
    for (const Body& b : world.bodies) report.sleeping_bodies += b.alive && b.asleep;
    world.clock.lap(Phase::kSleep);
}

}  // namespace cairn
