// Bodies in a wedge whose walls hold them by friction: impulses that grow without end there move nothing, until something turns.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <algorithm>

using namespace cairn;
using namespace world_building;

namespace {

// Two walls that lean outwards by `lean` [rad], and what falls in between.
World wedge(std::mt19937& random, Real& fastest) {
    const auto uniform = [&](Real low, Real high) { return std::uniform_real_distribution<Real>(low, high)(random); };
    const Real lean = uniform(0.05, 0.6), friction = uniform(0.5, 3);
    World world;
    for (const int side : {-1, 1}) {
        BodyDef wall = fixed(Shape::box({1, 2, 3}), {1.2 * side, 0, 1}, friction);
        wall.rotation = turn(Vec3::UnitY(), side * lean);
        world.add_body(wall);
    }
    const int count = std::uniform_int_distribution<int>(1, 3)(random);
    for (int i = 0; i < count; ++i) {
        const Shape shapes[] = {Shape::box({0.25, 0.3, 0.2}), Shape::sphere(0.3), Shape::capsule(0.2, 0.2)};
        BodyDef b = body(shapes[std::uniform_int_distribution<int>(0, 2)(random)], {uniform(-0.2, 0.2), uniform(-0.1, 0.1), 3.2 + 0.8 * i},
                         uniform(0, 1) < 0.5 ? 1 : 5, friction);
        b.linear_velocity = {0, 0, -uniform(0, 6)};
        b.angular_velocity = {uniform(-2, 2), uniform(-2, 2), uniform(-2, 2)};
        world.add_body(b);
        fastest = std::max(fastest, -b.linear_velocity.z());
    }
    return world;
}

}  // namespace

TEST_CASE("nothing leaves a wedge faster than it fell in") {
    constexpr int kScenes = 200;
    constexpr Real kDuration = 2;  // [s]
    std::mt19937 random(1);
    for (int k = 0; k < kScenes; ++k) {
        Real fastest = 0;
        World world = wedge(random, fastest);
        // Free fall for as long as there is, and twice that, since a heavy body that lands on a light one may send it off faster than it
        // came. Without the limits on impulses one scene in a hundred ends at hundreds of m/s.
        const Real bound = 2 * (fastest + kG * kDuration);
        Real most = 0;
        run(world, kDuration, kStep, [&](const StepReport&) {
            for (const BodyId id : world.bodies()) most = std::max(most, world.state(id).linear_velocity.norm());
        });
        INFO("scene " << k);
        CHECK(most < bound);
    }
}
