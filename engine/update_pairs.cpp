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

// A body's room is where its centre may be as long as the sphere that holds its shapes, with the margin that a shape has at rest, stays in
// the fat boxes of all shapes. Whether it stays there through the step is soon asked, and then nothing else has to be.
bool stays_in_room(const WorldData& world, const Body& body, Real dt) {
    const Real acceleration = body.is_awake() ? external_acceleration(world, body).norm() : 0;
    const Vec3 reach = Vec3::Constant(body.w.norm() * dt * body.radius + acceleration * dt * dt);
    const Vec3 end = body.X_WB.p + dt * body.v;
    const Vec3 lo = body.X_WB.p.cwiseMin(end) - reach, hi = body.X_WB.p.cwiseMax(end) + reach;
    return (body.room.lo.array() <= lo.array()).all() && (hi.array() <= body.room.hi.array()).all();
}

void find_room(const WorldData& world, Body& body) {
    body.room = {Vec3::Constant(-Body::kFar), Vec3::Constant(Body::kFar)};
    for (std::uint32_t s = body.shape_begin; s < body.shape_begin + body.shape_count; ++s) {
        const ShapeRecord& record = world.shapes[s];
        if (record.proxy == kNoProxy || record.shape.type == ShapeType::kPlane) continue;
        const Aabb inner = world.broad_phase.fat_aabb(record.proxy).grown(-(body.radius + kMarginShare * record.size));
        body.room = {body.room.lo.cwiseMax(inner.lo), body.room.hi.cwiseMin(inner.hi)};
    }
}

// What must stay covered of a shape through the step.
Aabb covered(const Body& body, const ShapeRecord& record, Real reach, Real dt) {
    return shape_aabb(record.shape, record.pose(body.transform())).swept(dt * body.v).grown(reach);
}

// Whether move_proxies would do anything.
bool leaves_boxes(const WorldData& world, const Body& body, Real dt) {
    for (std::uint32_t s = body.shape_begin; s < body.shape_begin + body.shape_count; ++s) {
        const ShapeRecord& record = world.shapes[s];
        if (record.proxy == kNoProxy || record.shape.type == ShapeType::kPlane) continue;
        if (!world.broad_phase.stays(record.proxy, covered(body, record, reach_without_way(world, body, record, dt), dt))) return true;
    }
    return body.shape_count == 0;
}

void move_proxies(WorldData& world, Body& body, Real dt) {
    const Vec3 way = dt * body.v;
    bool moved = body.shape_count == 0;
    for (std::uint32_t s = body.shape_begin; s < body.shape_begin + body.shape_count; ++s) {
        ShapeRecord& record = world.shapes[s];
        if (record.proxy == kNoProxy || record.shape.type == ShapeType::kPlane) continue;
        const Real reach = reach_without_way(world, body, record, dt);
        const Aabb tight = covered(body, record, reach, dt);
        const Aabb around = Aabb{body.X_WB.p, body.X_WB.p}.swept(way).grown(body.radius + reach);
        moved |= world.broad_phase.move(record.proxy, tight, way, body.is_awake() ? &around : nullptr);
    }
    if (moved) world.active.roomless.push_back(static_cast<std::uint32_t>(&body - world.bodies.data()));
}

bool may_have_left(const WorldData& world, const Body& body, Real dt) {
    return !body.stands && !stays_in_room(world, body, dt);
}

// With a team, it finds out who leaves his boxes; moving them is one thread's.
void move_awake_proxies(WorldData& world, Real dt) {
    constexpr std::size_t kPiece = 64;
    const std::vector<std::uint32_t>& awake = world.active.bodies.numbers();
    if (world.team != nullptr) {
        world.leaving.resize(awake.size());
        world.team->for_pieces(awake.size(), kPiece, [&](std::size_t begin, std::size_t end, int) {
            for (std::size_t k = begin; k < end; ++k) {
                const Body& body = world.bodies[awake[k]];
                world.leaving[k] = may_have_left(world, body, dt) && leaves_boxes(world, body, dt);
            }
        });
    }
    for (std::size_t k = 0; k < awake.size(); ++k) {
        Body& body = world.bodies[awake[k]];
        if (world.team != nullptr ? world.leaving[k] != 0 : may_have_left(world, body, dt)) move_proxies(world, body, dt);
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
    world.broad_phase.update_pairs(accept, world.begun, world.ended, world.team);
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
        if (body.moved && body.alive && body.enabled) {
            move_proxies(world, body, dt);
            note_motion(world, body, dt);
        }
        body.moved = false;
    }
    world.active.moved.clear();
    for (const std::uint32_t i : world.active.kinematic.numbers())
        if (is_moving(world.bodies[i])) move_proxies(world, world.bodies[i], dt);
    move_awake_proxies(world, dt);
    const std::uint64_t moved = world.broad_phase.moved_count() - moved_before;
    flush_broad_phase(world);
    for (const std::uint32_t i : world.active.roomless) find_room(world, world.bodies[i]);
    world.active.roomless.clear();
    report.pairs = static_cast<std::uint32_t>(world.contacts.size());
    if (!world.clock.on()) return;
    StepProfile& profile = world.clock.profile();
    profile.pairs_begun = static_cast<std::uint32_t>(world.begun.size());
    profile.pairs_ended = static_cast<std::uint32_t>(world.ended.size());
    profile.proxies_moved = static_cast<std::uint32_t>(moved);
    world.clock.lap(Phase::kBroadPhase);
}

}  // namespace cairn
