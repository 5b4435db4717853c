// Stacks stand, and the ground carries exactly their weight.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <algorithm>

using namespace cairn;
using namespace world_building;

namespace {

struct Load {
    Real worst = 0;  // largest |Σ λ_N / (dt m g) − 1| of a step
    Real drift = 0;  // [m], farthest that a body is from where it began
    Real penetration = 0;
};

// Steps for 5 s; the load is that of the last second.
Load load_of(World& world, Real dt) {
    std::vector<Vec3> start;
    Real mass = 0;
    for (BodyId id : world.bodies()) {
        start.push_back(world.state(id).position);
        mass += world.mass(id);
    }
    run(world, 4, dt);
    Load load;
    run(world, 1, dt, [&](const StepReport& r) {
        load.worst = std::max(load.worst, std::abs(ground_impulse(world) / dt / (mass * kG) - 1));
        load.penetration = std::max(load.penetration, r.max_penetration);
    });
    std::size_t k = 0;
    for (BodyId id : world.bodies()) load.drift = std::max(load.drift, (world.state(id).position - start[k++]).norm());
    return load;
}

}  // namespace

TEST_CASE("under a stack of ten the ground carries the weight in each step") {
    World world;
    world.add_body(ground());
    for (int k = 0; k < 10; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}, 2));
    const Load load = load_of(world, kStep);
    CAPTURE(load.worst, load.drift, load.penetration);
    CHECK(load.worst < 1e-3);
    CHECK(load.drift < 0.01);
    CHECK(load.penetration < 0.005);
}

TEST_CASE("under a pyramid of ten rows the ground carries the weight in each step") {
    World world;
    world.add_body(ground());
    for (int row = 0; row < 10; ++row)
        for (int k = 0; k < 10 - row; ++k) world.add_body(cube(1, {1.1 * (k - (9 - row) / 2.0), 0, 0.5 + row}, 2));
    const Load load = load_of(world, kStep);
    CAPTURE(load.worst, load.drift, load.penetration);
    CHECK(load.worst < 1e-3);
    CHECK(load.drift < 0.01);
    CHECK(load.penetration < 0.005);
}

TEST_CASE("three balls in a heap on each other are carried with their weight") {
    World world;
    world.add_body(ground(0.9));
    // Three on the ground that touch, held apart by walls, and one in the dent between them.
    for (int k = 0; k < 3; ++k) {
        const Real angle = 2 * kPi * k / 3;
        const Vec3 out(std::cos(angle), std::sin(angle), 0);
        world.add_body(ball(0.5, Vec3(out / std::sqrt(3.0) + 0.5 * Vec3::UnitZ()), 1, 0.9));
        world.add_body(fixed(Shape::plane(-out, -(1 / std::sqrt(3.0) + 0.5)), Vec3::Zero(), 0));
    }
    world.add_body(ball(0.5, {0, 0, 0.5 + std::sqrt(2.0 / 3)}, 1, 0.9));
    run(world, 3);
    CHECK(std::abs(ground_impulse(world) / kStep / (4 * kG) - 1) < 1e-3);
}

TEST_CASE("a heavy box on a light one stands") {
    World world;
    world.add_body(ground());
    const BodyId light = world.add_body(cube(1, {0, 0, 0.5}, 1)), heavy = world.add_body(cube(1, {0, 0, 1.5}, 20));
    const Load load = load_of(world, kStep);
    CAPTURE(load.worst, load.drift, load.penetration);
    CHECK(load.worst < 1e-3);
    CHECK(std::abs(world.state(light).position.z() - 0.5) < 0.01);
    CHECK(std::abs(world.state(heavy).position.z() - 1.5) < 0.02);
}
