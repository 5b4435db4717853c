// World::hash: everything that the next step depends on, and what the last one reported of contacts and joints.
#include "engine/base/hash.hpp"
#include "engine/world_impl.hpp"

namespace cairn {
namespace {

void hash_body(Hasher& h, const Body& b, const BodyInfo& info) {
    h.add_word(info.generation);
    h.add(b.X_WB.p), h.add(b.X_WB.q), h.add(b.v), h.add(b.w);
    h.add(b.force), h.add(b.torque);
    h.add_word(b.sleep_group);
    for (const bool flag : {b.enabled, b.asleep, b.moved, b.stands}) h.add_word(flag);
    h.add(b.inv_mass), h.add(b.inv_inertia_B);
    h.add(info.friction), h.add(info.restitution), h.add(info.torsional_friction), h.add(info.rolling_friction);
    h.add(info.rotation0), h.add(info.motion_time0);
    if (info.motion) h.add(info.motion->axis), h.add(info.motion->amplitude), h.add(info.motion->period), h.add(info.motion->phase);
}

void hash_control(Hasher& h, const ErrorControl& c) {
    for (const int n : {c.level, c.steps_left, c.interval, static_cast<int>(c.disturbed)}) h.add_word(static_cast<std::uint64_t>(n));
    h.add_word(c.signature);
    h.add(c.error), h.add(c.gained), h.add(c.jump), h.add(c.gain);
}

// The fat boxes decide which pairs exist.
void hash_fat_boxes(Hasher& h, const WorldData& world, const Body& b) {
    for (std::uint32_t s = b.shape_begin; s < b.shape_begin + b.shape_count; ++s) {
        const ShapeRecord& record = world.shapes[s];
        if (record.proxy == kNoProxy || record.shape.type == ShapeType::kPlane) continue;
        const Aabb& fat = world.broad_phase.fat_aabb(record.proxy);
        h.add(fat.lo), h.add(fat.hi);
    }
}

void hash_point(Hasher& h, const PointState& p) {
    h.add(p.core_a_A), h.add(p.core_b_B);
    h.add(p.radius_a), h.add(p.radius_b), h.add(p.separation);
    h.add_word(p.feature);
    h.add(p.warm_position), h.add(p.warm_velocity), h.add(p.warm_friction), h.add(p.warm_friction_first);
    h.add(p.normal_impulse), h.add(p.friction_impulse[0]), h.add(p.friction_impulse[1]);
    h.add(p.t1);
}

void hash_contact(Hasher& h, const Contact& c) {
    h.add_word(c.shape_a), h.add_word(c.shape_b), h.add_word(c.fresh), h.add_word(c.held);
    h.add(c.cache.axis), h.add(c.cache.gap);
    h.add(c.query_margin), h.add(c.apart.between), h.add(c.apart.limit);
    if (c.manifold_count > 0) h.add(c.manifold(0).X_AB_query.R), h.add(c.manifold(0).X_AB_query.p);
    h.add_word(static_cast<std::uint64_t>(c.manifold_count));
    for (int i = 0; i < c.manifold_count; ++i) {
        const CachedManifold& m = c.manifold(i);
        h.add(m.n), h.add(m.n_local);
        h.add_word(static_cast<std::uint64_t>(m.owner)), h.add_word(m.sub_key), h.add_word(static_cast<std::uint64_t>(m.count));
        h.add(m.warm_spin);
        for (int k = 0; k < m.count; ++k) hash_point(h, m.points[k]);
    }
}

void hash_joint(Hasher& h, const Joint& j) {
    h.add_word(static_cast<std::uint64_t>(j.type)), h.add_word(j.body_a), h.add_word(j.body_b), h.add_word(j.generation);
    h.add_word(j.collide_connected);
    const JointGeometry& g = j.geometry;
    h.add(g.anchor_a_A), h.add(g.anchor_b_B), h.add(g.frame_A), h.add(g.frame_B), h.add(g.length);
    for (int k = 0; k < 6; ++k) h.add(j.warm_first[k]), h.add(j.warm_second[k]), h.add(j.total[k]);
}

void hash_direct_state(Hasher& h, std::uint32_t body, const DirectState& state) {
    h.add_word(body), h.add_word(static_cast<std::uint64_t>(state.wait)), h.add_word(static_cast<std::uint64_t>(state.penalty));
    h.add(state.credit), h.add_word(state.stood), h.add_word(static_cast<std::uint64_t>(state.restless)), h.add_word(state.last_step),
        h.add_word(static_cast<std::uint64_t>(state.points));
    state.cache.add_to(h);
}

}  // namespace

std::uint64_t World::hash() const {
    Hasher h;
    const WorldData& world = impl_->data;
    h.add(world.time), h.add(world.last_dt), h.add(world.settings.gravity);
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
        const Body& b = world.bodies[i];
        h.add_word(b.alive);
        if (!b.alive) continue;
        hash_body(h, b, world.info[i]);
        if (i < world.rest.size())
            for (const RestWindow& window : world.rest[i].windows) h.add(window.X_WB.p), h.add(window.X_WB.q), h.add(window.time);
        if (i < world.control.size()) hash_control(h, world.control[i]);
        hash_fat_boxes(h, world, b);
    }
    for (const Contact& c : world.contacts.slots()) {
        h.add_word(c.alive);
        if (c.alive) hash_contact(h, c);
    }
    for (const Joint& j : world.joints) {
        h.add_word(j.alive);
        if (j.alive) hash_joint(h, j);
    }
    for (std::uint32_t k = 0; !world.direct_states.empty() && k < world.bodies.size(); ++k) {
        const auto entry = world.direct_states.find(k);
        if (entry != world.direct_states.end()) hash_direct_state(h, k, entry->second);
    }
    return h.value();
}

}  // namespace cairn
