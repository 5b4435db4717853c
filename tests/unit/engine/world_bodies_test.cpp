// Adding, removing, moving and pushing bodies; what happens to one that leaves the finite numbers.
#include "engine/base/error.hpp"
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <limits>

using namespace cairn;
using namespace world_building;

TEST_CASE("a body's record says what was asked for") {
    World world;
    BodyDef def = body(Shape::box({0.5, 0.3, 0.2}), {1, 2, 3}, 4);
    def.name = "crate";
    def.rotation = Quat(2, 0, 0, 2);  // is normalised
    def.linear_velocity = {1, 0, 0};
    def.angular_velocity = {0, 1, 0};
    const BodyId id = world.add_body(def);
    const BodyState s = world.state(id);
    CHECK(s.position == def.position);
    CHECK(std::abs(s.rotation.w() - std::sqrt(0.5)) < 1e-15);
    CHECK(s.linear_velocity == def.linear_velocity);
    CHECK(s.angular_velocity == def.angular_velocity);
    CHECK(world.type(id) == BodyType::kDynamic);
    CHECK(world.mass(id) == 4);
    CHECK(world.name(id) == "crate");
    // m/12 of the sums of squared edges.
    CHECK((world.inertia(id).diagonal() - Vec3(0.36 + 0.16, 1 + 0.16, 1 + 0.36) * 4 / 12).norm() < 1e-12);
    CHECK(world.mass(world.add_body(ground())) == 0);
    CHECK(world.body_count() == 2);
    CHECK(world.bodies().size() == 2);
    CHECK(world.time() == 0);
}

TEST_CASE("thousands of bodies added and removed use the same places again") {
    World world;
    world.add_body(ground());
    std::uint32_t highest = 0;
    for (int round = 0; round < 500; ++round) {
        std::vector<BodyId> ids;
        for (int k = 0; k < 8; ++k) ids.push_back(world.add_body(cube(0.5, {1.0 * k, 0, 0.25})));
        const JointId joint = world.add_joint({JointType::kBall, ids[0], ids[1], {0.5, 0, 0.25}});
        CHECK(joint.index == 0);
        if (round % 50 == 0) run(world, 3 * kStep);
        for (BodyId id : ids) {
            highest = std::max(highest, id.index);
            world.remove_body(id);
        }
        REQUIRE(world.body_count() == 1);
        REQUIRE(world.joint_count() == 0);
        REQUIRE(world.manifolds().empty());
    }
    CHECK(highest == 8);
    CHECK(world.step(kStep).pairs == 0);
}

TEST_CASE("what slept on a removed body wakes and falls") {
    WorldSettings settings;
    settings.sleep = true;
    World world(settings);
    const BodyId support = world.add_body(fixed(Shape::box({1, 1, 0.5}), {0, 0, 0.5}));
    const BodyId lower = world.add_body(cube(0.5, {0, 0, 1.25}));
    const BodyId upper = world.add_body(cube(0.5, {0, 0, 1.75}));
    run(world, 2);
    REQUIRE(world.is_sleeping(lower));
    REQUIRE(world.is_sleeping(upper));
    const Real before = world.state(upper).position.z();
    SECTION("the ground they stand on") {
        world.remove_body(support);
        CHECK_FALSE(world.is_sleeping(lower));
        CHECK_FALSE(world.is_sleeping(upper));
        run(world, 0.25);
        // Free fall of both: g t² / 2, but for the hair by which they overlapped and that is worked off.
        CHECK(std::abs(before - world.state(upper).position.z() - kG * 0.25 * 0.25 / 2) < 1e-3);
    }
    SECTION("the body in between") {
        world.remove_body(lower);
        CHECK_FALSE(world.is_sleeping(upper));
        run(world, 2);
        CHECK(std::abs(world.state(upper).position.z() - 1.25) < 1e-3);
    }
    SECTION("a static body that is put elsewhere") {
        BodyState away = world.state(support);
        away.position.x() = 50;
        world.set_state(support, away);
        CHECK_FALSE(world.is_sleeping(lower));
        run(world, 0.25);
        CHECK(std::abs(before - world.state(upper).position.z() - kG * 0.25 * 0.25 / 2) < 1e-3);
    }
}

TEST_CASE("forces, impulses, states and gravity wake a sleeper") {
    WorldSettings settings;
    settings.sleep = true;
    World world(settings);
    world.add_body(ground());
    const BodyId id = world.add_body(cube(1, {0, 0, 0.5}));
    run(world, 2);
    REQUIRE(world.is_sleeping(id));
    SECTION("impulse") {
        world.apply_impulse(id, {1, 0, 0}, {0, 0, 0.5});
    }
    SECTION("force") {
        world.set_force(id, {1, 0, 0}, Vec3::Zero());
    }
    SECTION("state") {
        world.set_state(id, world.state(id));
    }
    SECTION("gravity") {
        world.set_gravity({0, 0, -5});
    }
    SECTION("wake") {
        world.wake(id);
    }
    SECTION("a joint") {
        world.add_joint({JointType::kBall, id, BodyId{}, {0, 0, 1}});
    }
    CHECK_FALSE(world.is_sleeping(id));
}

TEST_CASE("an impulse changes the momenta by itself and its moment") {
    World world(no_gravity());
    BodyDef def = body(Shape::box({0.5, 0.3, 0.2}), {1, 2, 3}, 4);
    def.rotation = turn({1, 2, 3}, 0.7);
    const BodyId id = world.add_body(def);
    const Vec3 J(0.3, -0.2, 0.5), at(1.2, 2.3, 2.9);
    world.apply_impulse(id, J, at);
    CHECK((linear_momentum(world) - J).norm() < 1e-14);
    CHECK((angular_momentum(world) - at.cross(J)).norm() < 1e-14);
}

TEST_CASE("a constant force and torque act until they are set again") {
    World world(no_gravity());
    BodyDef def = ball(0.5, {0, 0, 0}, 2);
    def.force = {4, 0, 0};
    def.torque = {0, 0, 0.4};
    const BodyId id = world.add_body(def);
    run(world, 1, 1.0 / 64);
    // x = F t²/2m, ω = T t / I with I = 2/5 m r² = 0.2; sums of 64 terms.
    CHECK(std::abs(world.state(id).position.x() - 1) < 1e-13);
    CHECK(std::abs(world.state(id).linear_velocity.x() - 2) < 1e-13);
    CHECK(std::abs(world.state(id).angular_velocity.z() - 2) < 1e-13);
    world.set_force(id, Vec3::Zero(), Vec3::Zero());
    run(world, 1, 1.0 / 64);
    CHECK(std::abs(world.state(id).position.x() - 3) < 1e-13);
    CHECK(std::abs(world.state(id).angular_velocity.z() - 2) < 1e-13);
}

TEST_CASE("a state that is set is the state that is read, and the broad phase knows") {
    World world;
    world.add_body(ground());
    const BodyId id = world.add_body(cube(1, {0, 0, 5}));
    BodyState s;
    s.position = {30, 0, 0.5};
    s.rotation = turn({0, 0, 1}, 0.4);
    s.linear_velocity = {1, 2, 3};
    s.angular_velocity = {4, 5, 6};
    world.set_state(id, s);
    const BodyState back = world.state(id);
    CHECK(back.position == s.position);
    CHECK((back.rotation.coeffs() - s.rotation.coeffs()).norm() < 1e-15);
    CHECK(back.linear_velocity == s.linear_velocity);
    CHECK(back.angular_velocity == s.angular_velocity);
    s.linear_velocity.setZero();
    s.angular_velocity.setZero();
    world.set_state(id, s);
    CHECK(world.step(kStep).contacts == 4);
}

TEST_CASE("the error of a joint is the distance and the angle that were put into it") {
    World world(no_gravity());
    const BodyId a = world.add_body(cube(1, {0, 0, 0})), b = world.add_body(cube(1, {2, 0, 0}));
    const JointType type = GENERATE(JointType::kBall, JointType::kHinge, JointType::kSlider, JointType::kFixed, JointType::kDistance);
    CAPTURE(to_string(type));
    const JointId joint = world.add_joint({type, a, b, {0, 0, 0}, {2, 0, 0}, Vec3::UnitX()});
    CHECK(world.joint_error(joint).position < 1e-15);
    CHECK(world.joint_error(joint).angle < 1e-15);
    BodyState s = world.state(b);
    s.position += type == JointType::kDistance ? Vec3(0.01, 0, 0) : Vec3(0, 0.01, 0);
    world.set_state(b, s);
    CHECK(std::abs(world.joint_error(joint).position - 0.01) < 1e-12);
    CHECK(world.joint_error(joint).angle < 1e-12);
}

TEST_CASE("a body that leaves the finite numbers is taken out and reported, the rest goes on as without it") {
    // The wild one has a place of its own, so the others' rows, islands and pairs are those of the world without it.
    const auto build = [](World& world, std::vector<BodyId>& ids) {
        world.add_body(ground());
        for (int k = 0; k < 4; ++k) ids.push_back(world.add_body(cube(0.5, {0.02 * k, 0, 0.25 + 0.52 * k})));
        ids.push_back(world.add_body(ball(0.3, {3, 0, 1})));
    };
    WorldSettings settings;
    World without(settings), with(settings);
    std::vector<BodyId> ids, ids2;
    build(without, ids);
    build(with, ids2);
    BodyDef wild = ball(0.3, {500, 0, 500});
    bool overflows = true;
    SECTION("by a spin that overflows") {
        wild.angular_velocity = {1e200, 1e200, 1e200};
    }
    SECTION("by a force") {
        wild.force = {0, 1e308, 0}, wild.mass = 1e-3;
    }
    SECTION("by a torque") {
        wild.torque = {0, 1e308, 0};
    }
    // These may stay finite for the while: then they stay in.
    SECTION("by a large speed") {
        wild.linear_velocity = {1e308, 1e308, 0}, overflows = false;
    }
    SECTION("by a spin that is no sphere's") {
        wild.shapes = {Shape::box({0.5, 0.3, 0.2})};
        wild.angular_velocity = {1e160, 2e160, 3e160};
        overflows = false;
    }
    const BodyId id = with.add_body(wild);
    std::uint32_t disabled = 0;
    bool reported = false;
    for (int k = 0; k < 60; ++k) {
        REQUIRE(without.step(kStep).ok);
        const StepReport r = with.step(kStep);
        disabled += r.bodies_disabled;
        reported |= !r.ok;
        CHECK(r.ok == (r.bodies_disabled == 0));
        const BodyState s = with.state(id);
        REQUIRE((is_finite(s.position) && is_finite(s.rotation) && is_finite(s.linear_velocity) && is_finite(s.angular_velocity)));
    }
    CHECK(disabled <= 1);
    if (overflows) CHECK(disabled == 1);
    CHECK(with.is_enabled(id) == (disabled == 0));
    CHECK(reported == (disabled == 1));
    for (std::size_t k = 0; k < ids.size(); ++k) {
        const BodyState s = without.state(ids[k]), s2 = with.state(ids2[k]);
        CHECK(s.position == s2.position);
        CHECK(s.rotation.coeffs() == s2.rotation.coeffs());
        CHECK(s.linear_velocity == s2.linear_velocity);
        CHECK(s.angular_velocity == s2.angular_velocity);
    }
}

TEST_CASE("a body of the largest speed that hits a pile does not take the pile out of the finite numbers") {
    const Real speed = GENERATE(1e6, 1e100, 1e150, 1e300, 1e308);
    CAPTURE(speed);
    World world;
    world.add_body(ground());
    std::vector<BodyId> ids;
    for (int k = 0; k < 3; ++k) ids.push_back(world.add_body(cube(0.5, {0, 0, 0.25 + 0.5 * k})));
    BodyDef shot = ball(0.3, {0.56, 0, 0.75});
    shot.linear_velocity = {-speed, 0, 0};
    ids.push_back(world.add_body(shot));
    std::uint32_t disabled = 0;
    for (int k = 0; k < 30; ++k) {
        const StepReport r = world.step(kStep);
        disabled += r.bodies_disabled;
        CHECK(r.ok == (r.bodies_disabled == 0));
        for (BodyId id : ids) {
            const BodyState s = world.state(id);
            REQUIRE((is_finite(s.position) && is_finite(s.rotation) && is_finite(s.linear_velocity) && is_finite(s.angular_velocity)));
        }
    }
    std::uint32_t out = 0;
    for (BodyId id : ids) out += !world.is_enabled(id);
    CHECK(out == disabled);
}
