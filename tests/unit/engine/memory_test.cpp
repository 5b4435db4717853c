// A world that runs for long does not grow.
#include "engine/world.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <cmath>

#ifdef __GLIBC__
#include <malloc.h>
#endif

using namespace cairn;
using namespace world_building;

namespace {

// Bytes that the program holds; 0 where that cannot be known.
std::size_t bytes_in_use() {
#ifdef __GLIBC__
    if (allocation_count::available()) return mallinfo2().uordblks + mallinfo2().hblkhd;
#endif
    return 0;
}

// A heap of balls, boxes and capsules falls on the ground, and all of it is taken away again.
void one_round(World& world, std::uint64_t seed) {
    Random r(seed);
    std::vector<BodyId> bodies;
    for (int k = 0; k < 24; ++k) {
        const Vec3 p = Vec3(0, 0, 0.3 + 0.35 * (k / 4)) + r.vector(0.4);
        bodies.push_back(world.add_body(k % 3 == 0 ? ball(0.15, p) : k % 3 == 1 ? cube(0.25, p) : body(Shape::capsule(0.1, 0.1), p)));
    }
    run(world, 0.5);
    for (const BodyId id : bodies) world.remove_body(id);
    world.step(kStep);
}

}  // namespace

TEST_CASE("bodies that come and go leave nothing behind") {
    if (bytes_in_use() == 0) return;
    World world;
    world.add_body(ground());
    for (int round = 0; round < 60; ++round) one_round(world, 1 + round % 4);
    const std::size_t before = bytes_in_use();
    for (int round = 0; round < 40; ++round) one_round(world, 1 + round % 4);
    // Lists have about their greatest sizes by now, and so have the caches of the direct solver, which are kept for 256 steps (10 kB more are
    // seen). A contact left behind in each round would be 40 kB, and so would 40 bytes for each body.
    CHECK(bytes_in_use() <= before + 25'000);
}

TEST_CASE("pairs that are farther apart than they can come in a step are not asked of the narrow phase") {
    // Balls of radius 0.5. Side by side with a gap of 0.03, within the reach of both (2 % of the diameters: 0.04); or along a diagonal, so
    // that their boxes overlap (1.3 / √3 < 1) though they are 0.3 apart.
    for (const bool near : {true, false}) {
        World world(no_gravity());
        world.add_body(ball(0.5, {0, 0, 9}));
        world.add_body(ball(0.5, near ? Vec3(1.03, 0, 9) : Vec3(Vec3(0, 0, 9) + Vec3::Constant(1.3 / std::sqrt(3.0)))));
        const StepReport r = world.step(kStep);
        CHECK(r.pairs == 1);
        CHECK(r.narrow_queries == (near ? 1 : 0));
        CHECK(r.manifolds == (near ? 1 : 0));
    }
}
