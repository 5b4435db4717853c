// The direct solver: what rests stays where it is, whatever it weighs and however high it is stacked.
#include "engine/world.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

WorldSettings with(SolverChoice solver) {
    WorldSettings s;
    s.solver = solver;
    return s;
}

// A step in which nothing is left as it was because it stands (standing_test.cpp).
StepReport step_awake(World& world) {
    for (std::uint32_t k = 1; k < world.body_count(); ++k) world.wake({k, 0});
    return world.step(kStep);
}

// Farthest that a body gets from where it is in so many seconds.
Real drift_of(World& world, Real seconds) {
    std::vector<Vec3> start;
    for (BodyId id : world.bodies()) start.push_back(world.state(id).position);
    Real drift = 0;
    run(world, seconds, kStep, [&](const StepReport&) {
        std::size_t k = 0;
        for (BodyId id : world.bodies()) drift = std::max(drift, (world.state(id).position - start[k++]).norm());
    });
    return drift;
}

}  // namespace

// A solve ends at a residual below 1e-8 m/s; over 4 s no more than 4e-8 m of it can add up, times what a stack makes of a tilt at its foot.
TEST_CASE("a stack of thirty boxes stays where it is to a micrometre") {
    World world;
    world.add_body(ground());
    for (int k = 0; k < 30; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    CHECK(drift_of(world, 4) < 1e-6);
}

TEST_CASE("a box of a tonne on nine of a kilogram stays where it is to a micrometre") {
    World world;
    world.add_body(ground());
    for (int k = 0; k < 9; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}, 1));
    world.add_body(cube(1, {0, 0, 9.5}, 1000));
    CHECK(drift_of(world, 4) < 1e-6);
}

// Of the weight that a row carries, D sees the lighter body alone: it has to grow by what the heavier one is heavier.
TEST_CASE("a box of a million times the mass on nine others stays where it is to a micrometre") {
    World world;
    world.add_body(ground());
    for (int k = 0; k < 9; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}, 1));
    world.add_body(cube(1, {0, 0, 9.5}, 1e6));
    CHECK(drift_of(world, 4) < 1e-6);
}

// 351 boxes: what hardly moves is solved directly as far as its matrix costs less than the sweeps it saves.
TEST_CASE("a pyramid of twenty-six rows stays where it is to a micrometre") {
    World world;
    world.add_body(ground(0.8));
    const int rows = 26;
    for (int row = 0; row < rows; ++row)
        for (int k = 0; k < rows - row; ++k) world.add_body(cube(1, {1.1 * (k + 0.5 * row), 0, 0.5 + row}, 1, 0.8));
    CHECK(drift_of(world, 0.5) < 1e-6);
    CHECK(world.step(kStep).islands_of[static_cast<int>(SolverChoice::kDirect)] == 1);
}

// The same, larger and with less friction: rows slip before the loads are known. The few that change are corrected for, the matrix is not
// made anew, and the second half of a first step expects what the first half needed.
TEST_CASE("a first step of a pyramid of forty rows takes few factorisations, and then it stands") {
    World world;
    world.add_body(ground(0.6));
    const int rows = 40;
    for (int row = 0; row < rows; ++row)
        for (int k = 0; k < rows - row; ++k) world.add_body(cube(1, {1.04 * (k + 0.5 * row), 0, 0.5 + row}, 1, 0.6));
    const StepReport first = world.step(kStep);
    CHECK(first.islands_of[static_cast<int>(SolverChoice::kDirect)] == 1);
    CHECK(first.factorisations <= 4);
    for (int k = 0; k < 10; ++k) CHECK(world.step(kStep).factorisations == 0);
    CHECK(drift_of(world, 0.2) < 1e-9);
}

// Friction bounds that move with their loads slow an update down as a small D does; a D that is raised for that loses the first steps.
TEST_CASE("a box on a slope under its friction angle is solved directly from the first step on") {
    const Real theta = 0.4363, mu = 0.4803;  // tan θ = 0.466
    WorldSettings settings;
    settings.gravity = kG * Vec3(std::sin(theta), 0, -std::cos(theta));
    World world(settings);
    world.add_body(ground(mu));
    BodyDef box = body(Shape::box({0.4, 0.3, 0.18}), {0, 0, 0.18}, 5, mu);
    box.rotation = turn(Vec3::UnitZ(), 0.4);
    world.add_body(box);
    CHECK(world.step(kStep).islands_of[static_cast<int>(SolverChoice::kDirect)] == 1);
    CHECK(drift_of(world, 1) < 1e-7);
}

TEST_CASE("two leaning boards hold each other by friction alone") {
    World world;
    world.add_body(ground(0.8));
    const Real lean = 0.3, half = 1;
    // Their upper edges meet above the middle, their lower edges stand on the ground.
    for (const Real side : {-1.0, 1.0}) {
        BodyDef board = body(Shape::box({0.05, 0.5, half}), Vec3::Zero(), 1, 0.8);
        board.rotation = turn(Vec3::UnitY(), -side * lean);
        const Mat3 R = board.rotation.toRotationMatrix();
        const Vec3 foot = R * Vec3(-0.05 * side, 0, -half), top = R * Vec3(-0.05 * side, 0, half);
        board.position = Vec3(-top.x(), 0, -foot.z());
        world.add_body(board);
    }
    CHECK(drift_of(world, 3) < 1e-4);
}

TEST_CASE("what rests is not factorised again") {
    World world(with(SolverChoice::kDirect));
    world.add_body(ground());
    for (int k = 0; k < 5; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    const StepReport first = world.step(kStep);
    CHECK(first.factorisations > 0);
    CHECK(first.islands_of[static_cast<int>(SolverChoice::kDirect)] == 1);
    for (int k = 0; k < 10; ++k) CHECK(step_awake(world).factorisations == 0);
}

TEST_CASE("a step of what rests takes one pass over its rows") {
    World world(with(SolverChoice::kDirect));
    world.add_body(ground());
    for (int k = 0; k < 5; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    for (int k = 0; k < 3; ++k) world.step(kStep);
    for (int k = 0; k < 10; ++k) CHECK(step_awake(world).contact_sweeps == 1);
}

// Each box of a pyramid stands on two others by eight points, which share its weight as they like: nothing but rounding says how. What
// touches to 1e-8 m bears, whatever rounding says of its gap, so that the matrix of the first step serves for ever.
TEST_CASE("points that share a load without need do not change the matrix") {
    World world(with(SolverChoice::kDirect));
    world.add_body(ground());
    const int rows = 7;
    for (int row = 0; row < rows; ++row)
        for (int k = 0; k < rows - row; ++k) world.add_body(cube(1, {1.1 * (k + 0.5 * row), 0, 0.5 + row}));
    CHECK(world.step(kStep).factorisations > 0);
    std::uint64_t again = 0, passes = 0;
    const int steps = 300;
    for (int k = 0; k < steps; ++k) {
        const StepReport report = step_awake(world);
        again += report.factorisations;
        passes += report.contact_sweeps;
    }
    CHECK(again == 0);
    // Corrections, of some ten passes each, where the island has swayed up to the tolerance: not in one step of ten.
    CHECK(passes < 2 * steps);
}

// A gap under 1e-5 g h² is taken as closed; from there on it is closed in time, and nothing is lifted that lies on one.
TEST_CASE("a box that starts a hair above the ground lands and rests within a hair") {
    for (const Real gap : {1e-9, 1e-7, 1e-6, 1e-5}) {
        World world(with(SolverChoice::kDirect));
        world.add_body(ground());
        const BodyId box = world.add_body(cube(1, {0, 0, 0.5 + gap}));
        run(world, 2);
        CAPTURE(gap);
        CHECK(std::abs(world.state(box).position.z() - 0.5) < 3e-8);
        CHECK(world.state(box).linear_velocity.norm() < 1e-7);
    }
}

TEST_CASE("a resting stack that is solved directly allocates nothing") {
    World world(with(SolverChoice::kDirect));
    world.add_body(ground());
    for (int k = 0; k < 5; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    for (int k = 0; k < 5; ++k) step_awake(world);
    const std::uint64_t before = allocation_count::count();
    for (int k = 0; k < 20; ++k) step_awake(world);
    CHECK(allocation_count::count() == before);
}

// Closed form: a = g (sin θ − μ cos θ). Four substeps of 2nd order: exact but for the first touch.
TEST_CASE("a box slides down a slope as sequential impulses have it when it is solved directly") {
    for (const SolverChoice solver : {SolverChoice::kSi, SolverChoice::kDirect}) {
        const Real theta = 0.6, mu = 0.3;
        WorldSettings settings = with(solver);
        settings.gravity = kG * Vec3(std::sin(theta), 0, -std::cos(theta));
        World world(settings);
        world.add_body(ground(mu));
        const BodyId box = world.add_body(cube(0.4, {0, 0, 0.2}, 2, mu));
        run(world, 1);
        const Real a = kG * (std::sin(theta) - mu * std::cos(theta));
        CHECK(std::abs(world.state(box).position.x() / (0.5 * a) - 1) < 2e-3);
    }
}

TEST_CASE("a forced direct solver leaves an island of joints where it is, and says so") {
    World world(with(SolverChoice::kDirect));
    const BodyId bob = world.add_body(ball(0.1, {1, 0, 0}));
    JointDef joint;
    joint.type = JointType::kBall;
    joint.body_a = bob;
    joint.anchor_a = joint.anchor_b = Vec3::Zero();
    world.add_joint(joint);
    const StepReport report = world.step(kStep);
    CHECK_FALSE(report.ok);
    CHECK(report.islands_refused == 1);
    CHECK(world.state(bob).position == Vec3(1, 0, 0));
}

TEST_CASE("a forced direct solver leaves a bouncing ball where it is, and says so") {
    World world(with(SolverChoice::kDirect));
    world.add_body(ground(0.5, 0.8));
    BodyDef def = ball(0.5, {0, 0, 0.5});
    def.restitution = 0.8;
    const BodyId id = world.add_body(def);
    const StepReport report = world.step(kStep);
    CHECK_FALSE(report.ok);
    CHECK(report.islands_refused == 1);
    CHECK(world.state(id).position == Vec3(0, 0, 0.5));
}

TEST_CASE("two worlds that are solved directly agree to the bit") {
    const auto build = [] {
        World world;
        world.add_body(ground());
        for (int k = 0; k < 8; ++k) world.add_body(cube(1, {0.2 * (k % 2), 0, 0.5 + k}));
        return world;
    };
    World one = build(), other = build();
    for (int k = 0; k < 60; ++k) {
        one.step(kStep);
        other.step(kStep);
        REQUIRE(one.hash() == other.hash());
    }
}
