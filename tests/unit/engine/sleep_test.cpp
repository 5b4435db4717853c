// What falls asleep, what must not, and what wakes it. That sleepers cost nothing: work_counters_test.cpp.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

WorldSettings with_sleep() {
    WorldSettings s;
    s.sleep = true;
    return s;
}

BodyDef platform() {
    BodyDef b = fixed(Shape::box({1, 1, 0.5}), {0, 0, 0.5});
    b.type = BodyType::kKinematic;
    return b;
}

}  // namespace

TEST_CASE("a stack at rest falls asleep where it would have stayed awake") {
    World awake, asleep(with_sleep());
    std::vector<BodyId> boxes;
    for (World* world : {&awake, &asleep}) {
        boxes.clear();
        world->add_body(ground());
        for (int k = 0; k < 4; ++k) boxes.push_back(world->add_body(cube(0.5, {0, 0, 0.25 + 0.5 * k})));
        run(*world, 5);
    }
    for (const BodyId id : boxes) {
        CHECK(asleep.is_sleeping(id));
        // It fell asleep when it moved by less than 1e-7 m in 0.1 s; at the same pace it would have gone 5e-6 m.
        CHECK((asleep.state(id).position - awake.state(id).position).norm() < 5e-6);
    }
}

TEST_CASE("a ball thrown up beside a wall does not sleep at its apex") {
    World world(with_sleep());
    world.add_body(fixed(Shape::box({0.5, 2, 4}), {-0.5, 0, 4}, 0));
    BodyDef thrown = ball(0.25, {0.25, 0, 2}, 1, 0);  // touches the wall all the way
    thrown.linear_velocity = {0, 0, 3};
    const BodyId id = world.add_body(thrown);
    run(world, 1, kStep, [&](const StepReport& r) { CHECK(r.sleeping_bodies == 0); });
    // Constant acceleration is integrated exactly; g t² / 2 less the throw.
    CHECK(std::abs(world.state(id).position.z() - (2 + 3 - kG / 2)) < 1e-6);
}

TEST_CASE("a ball in a shallow bowl of two planks does not sleep at its turning points") {
    // It turns where it has no speed: that lasts far less than a rest.
    World world(with_sleep());
    for (const Real side : {-1.0, 1.0}) {
        BodyDef plank = fixed(Shape::box({2, 1, 0.1}), {1.9 * side, 0, 0});
        plank.rotation = turn({0, -side, 0}, 0.05);
        world.add_body(plank);
    }
    const BodyId id = world.add_body(ball(0.2, {1, 0, 0.27}));
    Real most = -10;
    for (int k = 0; k < 600; ++k) {
        world.step(kStep);
        if (world.is_sleeping(id)) break;
        if (k > 60) most = std::max(most, world.state(id).linear_velocity.norm());
    }
    CHECK(most > 0.2);                                                               // it did run
    if (world.is_sleeping(id)) CHECK(std::abs(world.state(id).position.x()) < 0.3);  // only ever at the bottom
}

TEST_CASE("a slow ball rolls on") {
    // 5 mm/s, half of what counts as slow: but it leaves its place.
    World world(with_sleep());
    world.add_body(ground());
    BodyDef rolling = ball(0.5, {0, 0, 0.5});
    rolling.linear_velocity = {5e-3, 0, 0};
    rolling.angular_velocity = {0, 1e-2, 0};
    const BodyId id = world.add_body(rolling);
    run(world, 4);
    CHECK_FALSE(world.is_sleeping(id));
    CHECK(std::abs(world.state(id).position.x() - 0.02) < 1e-5);
}

TEST_CASE("a box that hardly begins to slide slides") {
    // tan θ is over μ by 1 %: a = g (sin θ − μ cos θ) = 0.04 m/s², which stays slow for a quarter of a second.
    constexpr Real mu = 0.4, theta = 0.384;
    REQUIRE(std::tan(theta) > 1.005 * mu);
    World world(with_sleep());
    BodyDef slope = fixed(Shape::box({20, 2, 0.5}), Vec3::Zero(), mu);
    slope.rotation = turn({0, 1, 0}, theta);
    world.add_body(slope);
    BodyDef box = cube(0.5, slope.rotation * Vec3(0, 0, 0.75), 1, mu);
    box.rotation = slope.rotation;
    const BodyId id = world.add_body(box);
    run(world, 2);
    CHECK_FALSE(world.is_sleeping(id));
    const Real way = (world.state(id).position - box.position).norm(), a = kG * (std::sin(theta) - mu * std::cos(theta));
    CHECK(std::abs(way - a * 2 * 2 / 2) < 0.05 * way);
}

TEST_CASE("what is pushed out of another body does not sleep on the way") {
    // The push leaves no velocity behind: only the place tells.
    World world(with_sleep());
    world.add_body(ground());
    const BodyId id = world.add_body(cube(0.5, {0, 0, 0.2}));
    run(world, 5);
    CHECK(world.is_sleeping(id));
    CHECK(std::abs(world.state(id).position.z() - 0.25) < 2e-3);
}

TEST_CASE("a support that begins to move wakes what sleeps on it") {
    World world(with_sleep());
    const BodyId support = world.add_body(platform());
    const BodyId lower = world.add_body(cube(0.5, {0, 0, 1.25}));
    const BodyId upper = world.add_body(cube(0.5, {0, 0, 1.75}));
    run(world, 2);
    REQUIRE(world.is_sleeping(lower));
    BodyState s = world.state(support);
    SECTION("driven upwards") {
        s.linear_velocity = {0, 0, 0.3};
        world.set_state(support, s);
        run(world, 1);
        CHECK(std::abs(world.state(upper).position.z() - 2.05) < 2e-3);
        CHECK_FALSE(world.is_sleeping(upper));
    }
    SECTION("put away") {
        s.position.x() = 50;
        world.set_state(support, s);
        const Real before = world.state(upper).position.z();
        run(world, 0.25);
        CHECK(std::abs(before - world.state(upper).position.z() - kG * 0.25 * 0.25 / 2) < 1e-3);
    }
}

TEST_CASE("a body that comes wakes the sleeping island it touches, and no other") {
    World world(with_sleep());
    world.add_body(ground());
    std::vector<BodyId> near, far;
    for (int k = 0; k < 3; ++k) {
        near.push_back(world.add_body(cube(0.5, {0, 0, 0.25 + 0.5 * k})));
        far.push_back(world.add_body(cube(0.5, {5, 0, 0.25 + 0.5 * k})));
    }
    run(world, 2);
    for (const BodyId id : near) REQUIRE(world.is_sleeping(id));
    SECTION("a ball that hits the top") {
        world.add_body(ball(0.2, {0, 0, 1.9}));
        run(world, 0.3);
    }
    SECTION("a wall put into its side") {
        world.add_body(fixed(Shape::box({0.5, 0.5, 0.2}), {0.74, 0, 0.2}));
        run(world, kStep);
    }
    for (const BodyId id : near) CHECK_FALSE(world.is_sleeping(id));
    for (const BodyId id : far) CHECK(world.is_sleeping(id));
}

TEST_CASE("a force wakes once, not whenever it is said again") {
    World world(with_sleep());
    world.add_body(ground());
    const BodyId id = world.add_body(cube(1, {0, 0, 0.5}));
    run(world, 2);
    REQUIRE(world.is_sleeping(id));
    world.set_force(id, {1, 0, 0}, Vec3::Zero());  // friction holds it
    CHECK_FALSE(world.is_sleeping(id));
    for (int k = 0; k < 120; ++k) {
        world.set_force(id, {1, 0, 0}, Vec3::Zero());
        world.step(kStep);
    }
    CHECK(world.is_sleeping(id));
}

TEST_CASE("a jointed chain sleeps and wakes as one") {
    World world(with_sleep());
    std::vector<BodyId> links;
    for (int k = 0; k < 3; ++k) {
        links.push_back(world.add_body(cube(0.2, {0, 0, -0.5 - k})));
        world.add_joint({JointType::kBall, links[k], k == 0 ? BodyId{} : links[k - 1], {0, 0, -1.0 * k}});
    }
    run(world, 2);
    for (const BodyId id : links) REQUIRE(world.is_sleeping(id));
    world.apply_impulse(links[2], {0.1, 0, 0}, world.state(links[2]).position);
    for (const BodyId id : links) CHECK_FALSE(world.is_sleeping(id));
    run(world, kStep);
    CHECK(world.state(links[0]).linear_velocity.norm() > 1e-4);  // the joints hold again
}
