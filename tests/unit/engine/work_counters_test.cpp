// What a scene does not use costs nothing: the report's counters prove it.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

void build_stack(World& world, int count, Real friction = 0.5) {
    world.add_body(ground(friction));
    for (int k = 0; k < count; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}, 1, friction));
}

}  // namespace

TEST_CASE("an empty world does nothing") {
    World world;
    const StepReport r = world.step(kStep);
    CHECK(r.ok);
    CHECK(r.pairs + r.manifolds + r.contacts + r.manifolds_reused == 0);
    CHECK(r.narrow_queries + r.fcl_calls + r.fcl_failures == 0);
    CHECK(r.normal_rows + r.friction_rows + r.joint_rows + r.islands + r.free_bodies + r.sleeping_bodies == 0);
    CHECK(r.rotor_calls + r.joint_sweeps + r.contact_sweeps == 0);
    CHECK(r.max_penetration == 0);
    CHECK(r.residual == 0);
    CHECK(world.time() == kStep);
}

TEST_CASE("a projectile makes no pairs and no rows") {
    World world;
    world.add_body(ground());
    BodyDef shot = ball(0.1, {0, 0, 50});
    shot.linear_velocity = {30, 0, 10};
    world.add_body(shot);
    run(world, 1, kStep, [](const StepReport& r) {
        REQUIRE(r.pairs == 0);
        REQUIRE(r.narrow_queries == 0);
        REQUIRE(r.normal_rows + r.friction_rows + r.joint_rows == 0);
        REQUIRE(r.islands == 0);
        REQUIRE(r.contact_sweeps + r.joint_sweeps == 0);
        REQUIRE(r.free_bodies == 1);
    });
}

TEST_CASE("without friction there are no friction rows") {
    World world;
    build_stack(world, 3, 0);
    run(world, 0.5, kStep, [](const StepReport& r) {
        REQUIRE(r.normal_rows == 12);
        REQUIRE(r.friction_rows == 0);
    });
    // One side without friction is enough: a pair has sqrt(μ_a μ_b).
    World half;
    half.add_body(ground(0));
    half.add_body(cube(1, {0, 0, 0.5}, 1, 0.8));
    CHECK(half.step(kStep).friction_rows == 0);
}

TEST_CASE("a contact point with friction has two friction rows") {
    World world;
    build_stack(world, 3);
    const StepReport r = world.step(kStep);
    CHECK(r.contacts == 12);
    CHECK(r.normal_rows == 12);
    CHECK(r.friction_rows == 24);
    CHECK(r.manifolds == 3);
    CHECK(r.islands == 1);
    CHECK(r.free_bodies == 0);
}

TEST_CASE("a settled stack is not asked of the narrow phase again") {
    World world;
    build_stack(world, 10);
    run(world, 2);
    run(world, 1, kStep, [](const StepReport& r) {
        REQUIRE(r.fcl_calls == 0);
        REQUIRE(r.manifolds_reused == 10);
        REQUIRE(r.contacts == 40);
        // Nor are pairs of next but one, whose fat boxes overlap: they were found apart, and have not moved.
        REQUIRE(r.narrow_queries == 0);
    });
}

TEST_CASE("bodies with equal moments need no rotor") {
    World world(no_gravity());
    BodyDef spinning = ball(0.5, {0, 0, 0});
    spinning.angular_velocity = {1, 2, 3};
    world.add_body(spinning);
    spinning = cube(0.5, {5, 0, 0});
    spinning.angular_velocity = {1, 2, 3};
    world.add_body(spinning);
    run(world, 0.5, kStep, [](const StepReport& r) { REQUIRE(r.rotor_calls == 0); });
    BodyDef brick = body(Shape::box({0.5, 0.3, 0.2}), {10, 0, 0});
    world.add_body(brick);  // does not turn
    CHECK(world.step(kStep).rotor_calls == 0);
    brick.position.x() = 15;
    brick.angular_velocity = {1, 2, 3};
    world.add_body(brick);
    CHECK(world.step(kStep).rotor_calls == 1);
}

TEST_CASE("without joints there is no pass over joints, without contacts none over contacts") {
    World stack;
    build_stack(stack, 3);
    run(stack, 0.2, kStep, [&](const StepReport& r) {
        REQUIRE(r.joint_rows == 0);
        REQUIRE(r.joint_sweeps == 0);
        for (const BodyId id : stack.bodies()) stack.wake(id);  // what stands is not passed over
        REQUIRE(r.contact_sweeps > 0);
    });
    World pendulum;
    const BodyId bob = pendulum.add_body(ball(0.1, {1, 0, 0}));
    pendulum.add_joint({JointType::kBall, bob, BodyId{}, Vec3::Zero()});
    run(pendulum, 0.2, kStep, [](const StepReport& r) {
        REQUIRE(r.joint_rows == 3);
        REQUIRE(r.joint_sweeps > 0);
        REQUIRE(r.contact_sweeps == 0);
        REQUIRE(r.normal_rows == 0);
    });
}

TEST_CASE("rows of a joint are the freedoms it takes") {
    const auto [type, rows] = GENERATE(table<JointType, std::uint32_t>(
        {{JointType::kBall, 3}, {JointType::kHinge, 5}, {JointType::kSlider, 5}, {JointType::kFixed, 6}, {JointType::kDistance, 1}}));
    World world;
    const BodyId a = world.add_body(ball(0.1, {1, 0, 0}));
    world.add_joint({type, a, BodyId{}, {0, 0, 0}, {1, 0, 0}});
    CHECK(world.step(kStep).joint_rows == rows);
}

TEST_CASE("a sleeping world solves nothing and asks nothing") {
    WorldSettings settings;
    settings.sleep = true;
    World world(settings);
    build_stack(world, 5);
    run(world, 3);
    const std::uint64_t hash = world.hash();
    for (int k = 0; k < 10; ++k) {
        const StepReport r = world.step(kStep);
        CHECK(r.sleeping_bodies == 5);
        CHECK(r.islands == 0);
        CHECK(r.normal_rows + r.friction_rows + r.joint_rows == 0);
        CHECK(r.contact_sweeps + r.joint_sweeps == 0);
        CHECK(r.narrow_queries + r.fcl_calls == 0);
        CHECK(r.manifolds_reused == 0);
        CHECK(r.free_bodies == 0);
        CHECK(r.contacts == 20);  // they are still there
    }
    CHECK(world.hash() != hash);  // the time is part of the state
}
