// Stage 4a: joints → joint rows of an island.
#include "engine/world_data.hpp"

namespace cairn {
namespace {

// Index of a joint's body in the solver; what cannot move becomes the immovable body, its part of the geometry goes to world coordinates.
int joint_body(const WorldData& world, IslandWorkspace& work, std::uint32_t body, Vec3& anchor, Mat3& frame) {
    if (body == UINT32_MAX) return kImmovable;
    const Body& b = world.bodies[body];
    if (work.solver_index[body] >= 0) return work.solver_index[body];
    anchor = b.transform() * anchor;
    frame = b.R * frame;
    return kImmovable;
}

template <int N>
void add_joint_block(WorldData& world, IslandWorkspace& work, std::uint32_t index, std::vector<JointBlock<N>>& pool) {
    const Joint& joint = world.joints[index];
    JointBlock<N>& block = pool.emplace_back();
    block.geometry = joint.geometry;
    block.a = joint_body(world, work, joint.body_a, block.geometry.anchor_a_A, block.geometry.frame_A);
    block.b = joint_body(world, work, joint.body_b, block.geometry.anchor_b_B, block.geometry.frame_B);
    block.warm_first = joint.warm_first.head<N>();
    block.warm_second = joint.warm_second.head<N>();
    block.held_impulse.setZero();
    block.impulse.setZero();
    block.total.setZero();
    work.joint_sources[static_cast<int>(joint.type)].push_back({index});
}

void add_joint(WorldData& world, IslandWorkspace& work, std::uint32_t index) {
    JointPool& pool = work.joint_pool;
    switch (world.joints[index].type) {
        case JointType::kBall:
            add_joint_block<3>(world, work, index, pool.ball);
            return;
        case JointType::kHinge:
            add_joint_block<5>(world, work, index, pool.hinge);
            return;
        case JointType::kSlider:
            add_joint_block<5>(world, work, index, pool.slider);
            return;
        case JointType::kFixed:
            add_joint_block<6>(world, work, index, pool.fixed);
            return;
        case JointType::kDistance:
            add_joint_block<1>(world, work, index, pool.distance);
            return;
    }
}

template <int N>
void store_joints(WorldData& world, IslandWorkspace& work, const std::vector<JointBlock<N>>& pool, JointType type,
                  const JointRanges& ranges) {
    const int k = static_cast<int>(type);
    for (int i = ranges.begin[k]; i < ranges.end[k]; ++i) {
        Joint& joint = world.joints[work.joint_sources[k][i]];
        joint.warm_first.head<N>() = pool[i].warm_first;
        joint.warm_second.head<N>() = pool[i].warm_second;
        joint.total.head<N>() = pool[i].total;
    }
}

void joint_pool_sizes(const JointPool& pool, int sizes[5]) {
    const std::size_t n[5] = {pool.ball.size(), pool.hinge.size(), pool.slider.size(), pool.fixed.size(), pool.distance.size()};
    for (int k = 0; k < 5; ++k) sizes[k] = static_cast<int>(n[k]);
}

// An awake kinematic body that a joint holds enters the island like one that a contact touches.
void add_joint_kinematics(WorldData& world, IslandWorkspace& work, std::uint32_t index, SiIsland& island) {
    for (std::uint32_t body : {world.joints[index].body_a, world.joints[index].body_b}) {
        if (body == UINT32_MAX || world.bodies[body].type != BodyType::kKinematic || work.solver_index[body] >= 0) continue;
        add_kinematic(world, work, body, island);
    }
}

}  // namespace

void build_joint_blocks(WorldData& world, IslandWorkspace& work, int index, SiIsland& island) {
    const IndexRange joints = world.islands.items(index, IslandBuilder::kJoint);
    joint_pool_sizes(work.joint_pool, island.joints.begin);
    for (int k = joints.begin; k < joints.end; ++k) {
        add_joint_kinematics(world, work, world.islands.item_list(IslandBuilder::kJoint)[k], island);
        add_joint(world, work, world.islands.item_list(IslandBuilder::kJoint)[k]);
    }
    joint_pool_sizes(work.joint_pool, island.joints.end);
}

void store_joint_impulses(WorldData& world, IslandWorkspace& work, const SiIsland& island) {
    store_joints<3>(world, work, work.joint_pool.ball, JointType::kBall, island.joints);
    store_joints<5>(world, work, work.joint_pool.hinge, JointType::kHinge, island.joints);
    store_joints<5>(world, work, work.joint_pool.slider, JointType::kSlider, island.joints);
    store_joints<6>(world, work, work.joint_pool.fixed, JointType::kFixed, island.joints);
    store_joints<1>(world, work, work.joint_pool.distance, JointType::kDistance, island.joints);
}

}  // namespace cairn
