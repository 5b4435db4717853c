// Pairs that were found apart are asked of the narrow phase again when they may have met, not before.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

// Two cubes of side 1, turned by 45°, with a gap between two of their faces: their boxes overlap.
struct Slanted {
    static constexpr Real kGap = 0.1;  // [m]
    World world{no_gravity()};
    BodyId left, right;

    static BodyDef turned_cube(Real along) {
        BodyDef def = cube(1, along * Vec3(1, 1, 0).normalized());
        def.rotation = turn(Vec3::UnitZ(), kPi / 4);
        return def;
    }

    Slanted() : left(world.add_body(turned_cube(0))), right(world.add_body(turned_cube(1 + kGap))) {}
};

int queries(World& world, int steps) {
    int sum = 0;
    for (int k = 0; k < steps; ++k) sum += static_cast<int>(world.step(kStep).narrow_queries);
    return sum;
}

}  // namespace

TEST_CASE("a pair that was found apart and stays where it is is asked about once") {
    Slanted cubes;
    REQUIRE(cubes.world.step(kStep).pairs == 1);
    CHECK(queries(cubes.world, 30) == 0);
}

TEST_CASE("a pair that was found apart and moves together is not asked about again") {
    Slanted cubes;
    for (const BodyId id : {cubes.left, cubes.right}) {
        BodyState s = cubes.world.state(id);
        s.linear_velocity = {3, -2, 1};
        cubes.world.set_state(id, s);
    }
    cubes.world.step(kStep);
    CHECK(queries(cubes.world, 30) == 0);
}

TEST_CASE("a pair that was found apart meets when it is put together") {
    Slanted cubes;
    queries(cubes.world, 3);
    BodyState s = cubes.world.state(cubes.right);
    s.position = {0.6, 0.6, 0};
    cubes.world.set_state(cubes.right, s);
    const StepReport r = cubes.world.step(kStep);
    CHECK(r.narrow_queries == 1);
    CHECK(r.manifolds == 1);
    CHECK(r.max_penetration > 0.05);
}

TEST_CASE("a pair that was found apart meets when one of it is turned by its owner") {
    // A rod along x above a ball; turned to stand upright, it reaches through the ball.
    World world(no_gravity());
    const BodyId rod = world.add_body(body(Shape::box({1, 0.1, 0.1}), {0, 0, 1}));
    world.add_body(ball(0.3, {0, 0, 0.3}));
    BodyState s = world.state(rod);
    queries(world, 3);
    s.rotation = turn(Vec3::UnitY(), kPi / 2);
    world.set_state(rod, s);
    CHECK(world.step(kStep).manifolds == 1);
}

TEST_CASE("what only turns is found when it meets something, however it turned until then") {
    // A rod that spins about its middle at (0, 0, 0), and a post by its way: the rod's long side reaches it at the angle at which their
    // surfaces touch, atan2(y, x) of the post's axis less the angle that half the rod's width and the post's radius take at its distance.
    const Real width = 0.1, radius = 0.1, distance = 0.8, speed = GENERATE(0.2, 1.0, 4.0);
    const Real angle = GENERATE(0.6, 1.2);
    CAPTURE(speed, angle);
    World world(no_gravity());
    BodyDef rod = body(Shape::box({1, width / 2, width / 2}), Vec3::Zero());
    rod.angular_velocity = {0, 0, speed};
    world.add_body(rod);
    world.add_body(fixed(Shape::sphere(radius), distance * Vec3(std::cos(angle), std::sin(angle), 0)));
    const Real touch = angle - std::asin((width / 2 + radius) / distance);
    Real found = -1;
    for (int k = 0; k < 1000 && found < 0; ++k) {
        world.step(kStep);
        for (const ManifoldView& m : world.manifolds())
            for (int i = 0; i < m.count; ++i)
                if (m.points[i].normal_impulse > 0) found = k * kStep;
    }
    // Within the step in which it comes there.
    CHECK(found <= touch / speed + 1e-9);
    CHECK(found >= touch / speed - 1.01 * kStep);
    CHECK(world.step(kStep).max_penetration < 1e-3);
}
