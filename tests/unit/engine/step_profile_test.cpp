// The profile of a step: absent unless asked for, and true to what the step did.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <chrono>

using namespace cairn;
using namespace world_building;

namespace {

WorldSettings profiled() {
    WorldSettings settings;
    settings.profile = true;
    return settings;
}

void build_stack_and_ball(World& world) {
    world.add_body(ground());
    for (int k = 0; k < 3; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    world.add_body(ball(0.5, {5, 0, 0.5}));
    world.add_body(ball(0.5, {0, 9, 50}));
}

std::uint64_t sum(const std::uint32_t (&of)[kShapeTypes][kShapeTypes]) {
    std::uint64_t total = 0;
    for (const auto& row : of)
        for (const std::uint32_t count : row) total += count;
    return total;
}

int index(ShapeType type) {
    return static_cast<int>(type);
}

}  // namespace

TEST_CASE("a step that was not asked for a profile has none") {
    World world;
    build_stack_and_ball(world);
    CHECK(world.step(kStep).profile == nullptr);
}

TEST_CASE("the stages of a profiled step add up to no more than the step took") {
    World world(profiled());
    build_stack_and_ball(world);
    for (int k = 0; k < 30; ++k) {
        for (const BodyId id : world.bodies()) world.wake(id);  // what stands has no rows and no solve
        const auto start = std::chrono::steady_clock::now();
        const StepReport r = world.step(kStep);
        const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        REQUIRE(r.profile != nullptr);
        double total = 0;
        for (const double s : r.profile->seconds) {
            REQUIRE(s >= 0);
            total += s;
        }
        REQUIRE(total <= wall * (1 + 1e-9));  // a sum of differences of the same clock's readings, within `wall`
        for (const Phase phase : {Phase::kBroadPhase, Phase::kNarrowPhase, Phase::kRows, Phase::kSolve})
            REQUIRE(r.profile->seconds[static_cast<int>(phase)] > 0);
    }
}

TEST_CASE("queries and calls into FCL by the types of a pair add up to those of the report") {
    World world(profiled());
    build_stack_and_ball(world);
    std::uint64_t box_box = 0, box_plane = 0, sphere_plane = 0;
    run(world, 0.5, kStep, [&](const StepReport& r) {
        REQUIRE(sum(r.profile->queries_of) == r.narrow_queries);
        REQUIRE(sum(r.profile->fcl_calls_of) == r.fcl_calls);
        box_box += r.profile->queries_of[index(ShapeType::kBox)][index(ShapeType::kBox)];
        box_plane += r.profile->queries_of[index(ShapeType::kBox)][index(ShapeType::kPlane)];
        sphere_plane += r.profile->queries_of[index(ShapeType::kSphere)][index(ShapeType::kPlane)];
    });
    CHECK(box_box >= 2);  // each pair is new once
    CHECK(box_plane >= 1);
    CHECK(sphere_plane >= 1);
}

TEST_CASE("the pairs that begin are those of the first step, and end when the bodies part") {
    World world(profiled());
    world.add_body(ground());
    BodyDef rising = cube(1, {0, 0, 0.5});
    rising.linear_velocity = {0, 0, 20};
    world.add_body(rising);
    const StepReport first = world.step(kStep);
    CHECK(first.profile->pairs_begun == 1);
    CHECK(first.profile->pairs_ended == 0);
    std::uint32_t begun = 0, ended = 0, moved = 0;
    run(world, 0.5, kStep, [&](const StepReport& r) {
        begun += r.profile->pairs_begun;
        ended += r.profile->pairs_ended;
        moved += r.profile->proxies_moved;
    });
    CHECK(begun == 0);
    CHECK(ended == 1);
    CHECK(moved > 0);
}

TEST_CASE("a profiled world steps to the same bits") {
    World plain, measured(profiled());
    build_stack_and_ball(plain);
    build_stack_and_ball(measured);
    run(plain, 1);
    run(measured, 1);
    CHECK(plain.hash() == measured.hash());
}
