// Adding, removing and measuring joints.
#include "engine/base/error.hpp"
#include "engine/world_impl.hpp"

#include <cmath>

namespace cairn {
namespace {

JointPose joint_pose(const WorldData& world, std::uint32_t body) {
    if (body == UINT32_MAX) return {Vec3::Zero(), Mat3::Identity()};
    return {world.bodies[body].X_WB.p, world.bodies[body].R};
}

std::uint64_t body_pair(std::uint32_t a, std::uint32_t b) {
    return a < b ? (std::uint64_t{a} << 32 | b) : (std::uint64_t{b} << 32 | a);
}

void check_definition(const JointDef& def, const std::string& who) {
    if (def.body_a == def.body_b)
        throw Error(who + (def.body_a.is_world() ? ": joins the world with itself, must join two bodies or a body and the world"
                                                 : ": joins a body with itself, must join two bodies or a body and the world"));
    if (!is_finite(def.anchor_a)) throw Error(who + ".anchor_a: not finite");
    if (def.type == JointType::kDistance) {
        if (!is_finite(def.anchor_b)) throw Error(who + ".anchor_b: not finite");
        const Real length = (def.anchor_a - def.anchor_b).stableNorm();
        if (!(length > 0 && length <= kMostJointArm))
            throw_invalid(who + ": distance between the anchors [m]", length, "> 0 and at most 1e6");
    }
    if (def.type == JointType::kHinge || def.type == JointType::kSlider)
        if (!is_finite(def.axis) || !is_normalisable(def.axis.norm())) throw Error(who + ".axis: must be finite and neither zero nor huge");
}

void check_arm(const WorldData& world, const BodyId& id, const Vec3& anchor, const std::string& what) {
    if (id.is_world() || world.bodies[id.index].type != BodyType::kDynamic) return;
    const Real arm = (anchor - world.bodies[id.index].X_WB.p).stableNorm();
    if (!(arm <= kMostJointArm))
        throw_invalid(what + ": distance to the centre of mass of body \"" + world.info[id.index].name + "\" [m]", arm, "at most 1e6");
}

template <JointKind K>
World::JointError measure(const JointGeometry& g, const JointPose& a, const JointPose& b) {
    const auto c = joint_error<K>(g, a, b);
    if constexpr (K == JointKind::kDistance) return {std::abs(c[0]), 0};
    constexpr int position = K == JointKind::kSlider ? 2 : 3;
    World::JointError e{c.template head<position>().norm(), 0};
    if constexpr (joint_rows(K) > position) e.angle = c.template tail<joint_rows(K) - position>().norm();
    return e;
}

}  // namespace

const char* to_string(JointType type) {
    constexpr const char* names[] = {"ball", "hinge", "slider", "fixed", "distance"};
    return names[static_cast<int>(type)];
}

JointId World::add_joint(const JointDef& def) {
    WorldData& world = impl_->data;
    const std::string who = std::string(to_string(def.type)) + " joint";
    check_definition(def, who);
    bool dynamic = false;
    for (const BodyId& id : {def.body_a, def.body_b})
        if (!id.is_world()) dynamic |= impl_->body(id).type == BodyType::kDynamic;
    if (!dynamic) throw Error(who + ": neither body is dynamic, at least one must be");
    check_arm(world, def.body_a, def.anchor_a, who + ".anchor_a");
    if (def.type == JointType::kDistance) {
        check_arm(world, def.body_b, def.anchor_b, who + ".anchor_b");
    } else {
        check_arm(world, def.body_b, def.anchor_a, who + ".anchor_a");
    }

    Joint joint;
    joint.type = def.type;
    joint.body_a = def.body_a.index;
    joint.body_b = def.body_b.index;
    joint.collide_connected = def.collide_connected;
    const JointPose a = joint_pose(world, joint.body_a), b = joint_pose(world, joint.body_b);
    const Vec3 anchor_b = def.type == JointType::kDistance ? def.anchor_b : def.anchor_a;
    joint.geometry.anchor_a_A = a.R.transpose() * (def.anchor_a - a.x);
    joint.geometry.anchor_b_B = b.R.transpose() * (anchor_b - b.x);
    joint.geometry.length = (def.anchor_a - anchor_b).norm();
    Mat3 frame = Mat3::Identity();
    if (def.type == JointType::kHinge || def.type == JointType::kSlider) {
        frame.col(0) = def.axis.normalized();
        frame.col(1) = any_perpendicular(frame.col(0));
        frame.col(2) = frame.col(0).cross(frame.col(1));
    }
    joint.geometry.frame_A = a.R.transpose() * frame;
    joint.geometry.frame_B = b.R.transpose() * frame;

    std::uint32_t index;
    if (world.free_joints.empty()) {
        index = static_cast<std::uint32_t>(world.joints.size());
        world.joints.push_back(joint);
    } else {
        index = world.free_joints.back();
        world.free_joints.pop_back();
        joint.generation = world.joints[index].generation;
        world.joints[index] = joint;
    }
    for (std::uint32_t body : {joint.body_a, joint.body_b})
        if (body != UINT32_MAX) wake_group(world, body);
    activate_joint(world, index);
    if (!def.collide_connected && !def.body_a.is_world() && !def.body_b.is_world()) {
        ++world.jointed_pairs[body_pair(joint.body_a, joint.body_b)];
        world.active.contact_links.for_each(joint.body_a, [&](std::uint32_t slot, std::uint32_t other) {
            if (other == joint.body_b) end_contact(world, slot);
        });
    }
    return {index, joint.generation};
}

void World::remove_joint(JointId id) {
    WorldData& world = impl_->data;
    Joint& joint = impl_->joint(id);
    joint.alive = false;
    end_joint(world, id.index);
    ++joint.generation;
    world.free_joints.push_back(id.index);
    for (std::uint32_t body : {joint.body_a, joint.body_b}) {
        if (body == UINT32_MAX) continue;
        wake_group(world, body);
        mark_moved(world, body);
    }
    if (joint.collide_connected || joint.body_a == UINT32_MAX || joint.body_b == UINT32_MAX) return;
    const auto pair = world.jointed_pairs.find(body_pair(joint.body_a, joint.body_b));
    if (pair != world.jointed_pairs.end() && --pair->second == 0) world.jointed_pairs.erase(pair);
}

World::JointError World::joint_error(JointId id) const {
    return measure_joint(impl_->data, impl_->joint(id));
}

World::JointError measure_joint(const WorldData& world, const Joint& j) {
    const JointPose a = joint_pose(world, j.body_a), b = joint_pose(world, j.body_b);
    switch (j.type) {
        case JointType::kBall:
            return measure<JointKind::kBall>(j.geometry, a, b);
        case JointType::kHinge:
            return measure<JointKind::kHinge>(j.geometry, a, b);
        case JointType::kSlider:
            return measure<JointKind::kSlider>(j.geometry, a, b);
        case JointType::kFixed:
            return measure<JointKind::kFixed>(j.geometry, a, b);
        case JointType::kDistance:
            return measure<JointKind::kDistance>(j.geometry, a, b);
    }
    return {};
}

}  // namespace cairn
