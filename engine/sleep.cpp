// Stage 6: islands at rest fall asleep together and wake together. Only with WorldSettings::sleep.
#include "engine/world_data.hpp"

#include <algorithm>

namespace cairn {
namespace {

// An island sleeps once all its bodies have been slow and have stayed where they are: by a hair for a short time, which only what really
// rests does, or roughly for a longer one. A fall passes such speeds within some milliseconds; what creeps, rolls on or begins to slide
// leaves its place, however slow it is; and so does what is being pushed out of another body, which has no velocity at all.
constexpr Real kSleepSpeed = 0.01;  // [m/s], of the centre and, by spin, of the farthest point
struct Rest {
    Real time;  // [s]
    Real way;   // [m], of the centre and, by rotation, of the farthest point
};
constexpr Rest kRests[2] = {{0.1, 1e-7}, {0.5, 1e-4}};

Real farthest_way(const Body& b, const Pose& from) {
    const Real sine = (from.q.conjugate() * b.X_WB.q).vec().norm();  // of half the angle
    return (b.X_WB.p - from.p).norm() + 2 * sine * b.radius;
}

// Brings the windows up to date with a step of dt.
void watch_rest(const Body& b, RestState& rest, Real dt) {
    const bool is_slow = b.v.norm() + b.w.norm() * b.radius < kSleepSpeed;
    for (int k = 0; k < 2; ++k) {
        RestWindow& window = rest.windows[k];
        if (is_slow && farthest_way(b, window.X_WB) <= kRests[k].way)
            window.time += dt;
        else
            window = {b.X_WB, 0};
    }
}

void fall_asleep(WorldData& world, const IndexRange& range) {
    const std::vector<std::uint32_t>& list = world.islands.body_list();
    for (int k = range.begin; k < range.end; ++k) {
        Body& b = world.bodies[list[k]];
        b.asleep = true;
        b.sleep_next = list[k + 1 < range.end ? k + 1 : range.begin];
        b.v.setZero();
        b.w.setZero();
        b.sleep_group = world.next_sleep_group;
    }
    ++world.next_sleep_group;
    world.active.sleeping += static_cast<std::uint32_t>(range.end - range.begin);
    world.active.has_stopped = true;
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
    const auto begin_anew = [&](std::uint32_t i) {
        world.bodies[i].stands = false;
        if (i < world.rest.size()) world.rest[i] = RestState();
        if (i < world.control.size()) world.control[i].disturbed = true;
    };
    begin_anew(body);
    for (std::uint32_t i = body; world.bodies[i].asleep; i = world.bodies[i].sleep_next) {
        world.bodies[i].asleep = false;
        begin_anew(i);
        --world.active.sleeping;
        activate(world, i);
    }
}

void wake_neighbours(WorldData& world, std::uint32_t body) {
    world.active.contact_links.for_each(body, [&](std::uint32_t, std::uint32_t other) { wake_group(world, other); });
}

void wake_touched(WorldData& world) {
    if (world.active.sleeping == 0) return;
    for (bool changed = true; changed;) {  // a woken group may touch another
        changed = false;
        refresh_active(world);
        const auto wake = [&](std::uint32_t i, std::uint32_t k) {
            const Body &a = world.bodies[i], &b = world.bodies[k];
            if (a.asleep == b.asleep || !is_moving(a.asleep ? b : a)) return;
            wake_group(world, a.asleep ? i : k);
            changed = true;
        };
        for (const std::uint32_t slot : world.active.contacts.numbers()) {
            const auto [i, k] = world.active.contact_links.bodies(slot);
            if (world.bodies[i].asleep != world.bodies[k].asleep && is_touching(world.contacts.slots()[slot])) wake(i, k);
        }
        for (const std::uint32_t joint : world.active.joints.numbers()) {
            const auto [i, k] = world.active.joint_links.bodies(joint);
            if (i != Links::kNoEnd && k != Links::kNoEnd) wake(i, k);
        }
    }
}

void put_to_sleep(WorldData& world, Real dt, StepReport& report) {
    if (!world.settings.sleep) return;
    world.rest.resize(world.bodies.size());
    const IslandBuilder& islands = world.islands;
    for (int i = 0; i < islands.count(); ++i) {
        const IndexRange range = islands.bodies(i);
        bool rests[2] = {true, true};
        for (int k = range.begin; k < range.end; ++k) {
            const std::uint32_t body = islands.body_list()[k];
            watch_rest(world.bodies[body], world.rest[body], dt);
            for (int j = 0; j < 2; ++j) rests[j] &= world.rest[body].windows[j].time >= kRests[j].time;
        }
        if (rests[0] || rests[1]) fall_asleep(world, range);
    }
    report.sleeping_bodies = world.active.sleeping;
    world.clock.lap(Phase::kSleep);
}

}  // namespace cairn
