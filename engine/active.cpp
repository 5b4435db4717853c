#include "engine/active.hpp"

#include "engine/world_data.hpp"

namespace cairn {
namespace {

// What the report counts of contacts that no step passes over: added when one leaves the list, taken off when it comes back.
void count_quiet(ActiveSets& active, const Contact& c, bool add) {
    for (int i = 0; i < c.manifold_count; ++i) {
        const std::uint32_t points = static_cast<std::uint32_t>(c.manifold(i).count);
        if (points == 0) continue;
        active.quiet_manifolds += add ? 1 : -1;
        active.quiet_points += add ? points : -points;
    }
}

}  // namespace

void activate(WorldData& world, std::uint32_t body) {
    ActiveSets& active = world.active;
    const Body& b = world.bodies[body];
    if (b.type == BodyType::kDynamic) active.bodies.add(body);
    if (b.type == BodyType::kKinematic) active.kinematic.add(body);
    if (!is_moving(b)) return;
    active.contact_links.for_each(body, [&](std::uint32_t slot, std::uint32_t) {
        if (!active.contacts.contains(slot)) count_quiet(active, world.contacts.slots()[slot], false);
        active.contacts.add(slot);
    });
    active.joint_links.for_each(body, [&](std::uint32_t joint, std::uint32_t) { active.joints.add(joint); });
}

void activate_contact(WorldData& world, std::uint32_t slot) {
    const Contact& c = world.contacts.slots()[slot];
    world.active.contact_links.add(slot, c.body_a, c.body_b);
    world.active.contacts.add(slot);
}

void activate_joint(WorldData& world, std::uint32_t joint) {
    world.active.joint_links.add(joint, world.joints[joint].body_a, world.joints[joint].body_b);
    world.active.joints.add(joint);
}

void end_contact(WorldData& world, std::uint32_t slot) {
    const Contact& c = world.contacts.slots()[slot];
    if (!world.active.contacts.contains(slot)) count_quiet(world.active, c, false);
    if (c.held) world.bodies[c.body_a].stands = world.bodies[c.body_b].stands = false;
    world.active.contact_links.remove(slot);
    world.contacts.remove(c.shape_a, c.shape_b);
    world.active.has_ended = true;
}

void end_joint(WorldData& world, std::uint32_t joint) {
    world.active.joint_links.remove(joint);
    world.active.has_ended = true;
}

void refresh_active(WorldData& world) {
    ActiveSets& active = world.active;
    const auto moves = [&](std::uint32_t body) { return body != Links::kNoEnd && is_moving(world.bodies[body]); };
    const auto has_motion = [&](const Links& links, std::uint32_t edge) {
        return links.contains(edge) && (moves(links.bodies(edge)[0]) || moves(links.bodies(edge)[1]));
    };
    const auto keep_contact = [&](std::uint32_t slot) {
        const Contact& c = world.contacts.slots()[slot];
        if (!c.alive || c.fresh || has_motion(active.contact_links, slot)) return c.alive;
        count_quiet(active, c, true);
        return false;
    };
    if (active.has_stopped) {
        active.bodies.filter([&](std::uint32_t i) { return world.bodies[i].is_awake(); });
        active.kinematic.filter([&](std::uint32_t i) { return world.bodies[i].type == BodyType::kKinematic && world.bodies[i].enabled; });
        active.contacts.filter(keep_contact);
        active.joints.filter([&](std::uint32_t k) { return has_motion(active.joint_links, k); });
    } else if (active.has_ended) {
        active.contacts.filter([&](std::uint32_t k) { return active.contact_links.contains(k); });
        active.joints.filter([&](std::uint32_t k) { return active.joint_links.contains(k); });
    }
    active.has_ended = active.has_stopped = false;
    active.bodies.merge();
    active.kinematic.merge();
    active.contacts.merge();
    active.joints.merge();
}

void mark_moved(WorldData& world, std::uint32_t body) {
    if (world.bodies[body].moved) return;
    world.bodies[body].moved = true;
    world.active.moved.push_back(body);
}

}  // namespace cairn
