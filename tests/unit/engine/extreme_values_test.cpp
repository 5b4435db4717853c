// Finite numbers whose squares or differences are not.
#include "engine/base/error.hpp"
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

bool is_finite(const BodyState& s) {
    return cairn::is_finite(s.position) && cairn::is_finite(s.rotation) && cairn::is_finite(s.linear_velocity) &&
           cairn::is_finite(s.angular_velocity);
}

}  // namespace

TEST_CASE("a kinematic body that leaves the finite numbers is taken out and reported") {
    World world;
    BodyDef def = cube(1, {50, 0, 5});
    def.type = BodyType::kKinematic;
    SECTION("by its speed") {
        def.linear_velocity = {1e308, 0, 0};
    }
    SECTION("by its spin") {
        def.angular_velocity = {1e308, 0, 0};
    }
    SECTION("by its motion") {
        def.motion = RotateSine{Vec3::UnitZ(), 1e308, 1e-300, 0};
    }
    const BodyId id = world.add_body(def);
    std::uint32_t disabled = 0;
    run(world, 4, 1.0, [&](const StepReport& r) { disabled += r.bodies_disabled; });
    CHECK(disabled == 1);
    CHECK_FALSE(world.is_enabled(id));
    CHECK(is_finite(world.state(id)));
}

TEST_CASE("a rotation of huge norm is refused or normalised, never made zero") {
    World world;
    BodyDef def = cube(1, {0, 0, 5});
    def.rotation = Quat(1e200, 0, 0, 1e200);
    try {
        const BodyId id = world.add_body(def);
        CHECK(std::abs(world.state(id).rotation.norm() - 1) < 1e-12);
    } catch (const Error& e) {
        CHECK_THAT(e.what(), Catch::Contains("rotation"));
    }
}

TEST_CASE("a joint axis of huge length is refused or normalised") {
    World world;
    const BodyId id = world.add_body(cube(1, {0, 0, 5}));
    try {
        world.add_joint({JointType::kHinge, id, BodyId{}, {0, 0, 5}, Vec3::Zero(), {1e200, 0, 0}});
        CHECK(world.step(kStep).ok);
    } catch (const Error& e) {
        CHECK_THAT(e.what(), Catch::Contains("axis"));
    }
}

// Hidden because a failure of this one takes the program with it.
TEST_CASE("bodies as far apart as numbers go leave the broad phase whole") {
    const Real far = GENERATE(1e15, 1e160, 8e307, 1e308, 1.7e308);
    CAPTURE(far);
    World world;
    world.add_body(ground());
    const BodyId near = world.add_body(cube(0.5, {0, 0, 0.25}));
    world.add_body(cube(0.5, {far, 0, far}));
    world.add_body(cube(0.5, {-far, far, 0}));
    run(world, 0.5);
    const BodyId late = world.add_body(cube(0.5, {0, 0, 1}));
    run(world, 2);
    CHECK(std::abs(world.state(near).position.z() - 0.25) < 1e-3);
    CHECK(std::abs(world.state(late).position.z() - 0.75) < 1e-3);
}
