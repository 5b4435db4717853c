// Stage 1: tells the broad phase what moved; contacts begin and end with overlaps of fat boxes.
#include "engine/reach.hpp"
#include "engine/world_data.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

std::uint64_t pair_key(std::uint32_t a, std::uint32_t b) {
    return a < b ? (std::uint64_t{a} << 32 | b) : (std::uint64_t{b} << 32 | a);
}

void move_proxies(WorldData& world, const Body& body, Real dt) {
    const Transform X_WB = body.transform();
    const Vec3 way = dt * body.v;
    for (std::uint32_t s = body.shape_begin; s < body.shape_begin + body.shape_count; ++s) {
        ShapeRecord& record = world.shapes[s];
        if (record.proxy == kNoProxy || record.shape.type == ShapeType::kPlane) continue;
        const Aabb tight = shape_aabb(record.shape, X_WB * record.X_BS).swept(way).grown(reach_without_way(world, body, record, dt));
        world.broad_phase.move(record.proxy, tight, way);
    }
}

void begin_contact(WorldData& world, std::uint32_t shape_a, std::uint32_t shape_b) {
    const ShapeRecord &a = world.shapes[shape_a], &b = world.shapes[shape_b];
    const BodyInfo &info_a = world.info[a.body], &info_b = world.info[b.body];
    Contact c;
    c.shape_a = shape_a;
    c.shape_b = shape_b;
    c.body_a = a.body;
    c.body_b = b.body;
    c.mu = std::sqrt(info_a.friction * info_b.friction);
    c.restitution = std::max(info_a.restitution, info_b.restitution);
    c.size = std::min(a.size, b.size);
    activate_contact(world, world.contacts.add(c));
    // A support that has come, or has been put there.
    if (world.bodies[a.body].type == BodyType::kStatic) wake_group(world, b.body);
    if (world.bodies[b.body].type == BodyType::kStatic) wake_group(world, a.body);
}

}  // namespace

bool may_collide(const WorldData& world, std::uint32_t body_a, std::uint32_t body_b) {
    if (body_a == body_b) return false;
    const Body &a = world.bodies[body_a], &b = world.bodies[body_b];
    if (!a.is_dynamic() && !b.is_dynamic()) return false;
    return world.jointed_pairs.empty() || !world.jointed_pairs.contains(pair_key(body_a, body_b));
}

void flush_broad_phase(WorldData& world) {
    const auto accept = [&](std::uint32_t s, std::uint32_t t) { return may_collide(world, world.shapes[s].body, world.shapes[t].body); };
    world.broad_phase.update_pairs(accept, world.begun, world.ended);
    for (const ProxyPair& p : world.ended) {
        const std::uint32_t slot = world.contacts.find(world.broad_phase.user(p.a), world.broad_phase.user(p.b));
        if (slot != PairMap::kNone) end_contact(world, slot);
    }
    for (const ProxyPair& p : world.begun) begin_contact(world, world.broad_phase.user(p.a), world.broad_phase.user(p.b));
}

void update_pairs(WorldData& world, Real dt, StepReport& report) {
    const std::uint64_t moved_before = world.broad_phase.moved_count();
    for (const std::uint32_t i : world.active.moved) {
        Body& body = world.bodies[i];
        if (body.moved && body.alive && body.enabled) move_proxies(world, body, dt);
        body.moved = false;
    }
    world.active.moved.clear();
    for (const std::uint32_t i : world.active.kinematic.numbers())
        if (is_moving(world.bodies[i])) move_proxies(world, world.bodies[i], dt);
    for (const std::uint32_t i : world.active.bodies.numbers()) move_proxies(world, world.bodies[i], dt);
    const std::uint64_t moved = world.broad_phase.moved_count() - moved_before;
    flush_broad_phase(world);
    report.pairs = static_cast<std::uint32_t>(world.contacts.size());
    if (!world.clock.on()) return;
    StepProfile& profile = world.clock.profile();
    profile.pairs_begun = static_cast<std::uint32_t>(world.begun.size());
    profile.pairs_ended = static_cast<std::uint32_t>(world.ended.size());
    profile.proxies_moved = static_cast<std::uint32_t>(moved);
    world.clock.lap(Phase::kBroadPhase);
}

}  // namespace cairn
