// Soft contacts in substeps.
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

WorldSettings tgs(int substeps = 4) {
    WorldSettings s;
    s.solver = SolverChoice::kTgs;
    s.substeps = substeps;
    return s;
}

// [m], by how much the box of 1 m at rest on the ground lies too low.
Real sinks(int substeps) {
    World world(tgs(substeps));
    world.add_body(ground());
    const BodyId id = world.add_body(cube(1, {0, 0, 0.5}));
    run(world, 2);
    return 0.5 - world.state(id).position.z();
}

}  // namespace

TEST_CASE("soft contacts in substeps let a box sink by what their springs give, a fourth for half the substep") {
    // Implicit springs of rate ω, per kg of a row: the load g is borne at g (2 ζ ω h + ω² h²) / ... of order g / ω², and ω h is fixed.
    const Real four = sinks(4), eight = sinks(8);
    CHECK(four > 1e-6);
    CHECK(four < 1e-3);
    CHECK(std::abs(four / eight - 4) < 0.4);
}

TEST_CASE("soft contacts hold a stack of five, and are reported as what solved it") {
    World world(tgs());
    world.add_body(ground());
    BodyId top;
    for (int k = 0; k < 5; ++k) top = world.add_body(cube(1, {0, 0, 0.5 + k}));
    StepReport report;
    run(world, 5, kStep, [&](const StepReport& r) { report = r; });
    CHECK(report.islands_of[static_cast<int>(SolverChoice::kTgs)] == 1);
    CHECK((world.state(top).position - Vec3(0, 0, 4.5)).norm() < 0.02);
}

TEST_CASE("soft joints hold a chain of two boxes together") {
    World world(tgs());
    world.add_body(ground());
    const BodyId a = world.add_body(cube(0.4, {0, 0, 2}, 1)), b = world.add_body(cube(0.4, {0.5, 0, 2}, 1));
    world.add_joint({JointType::kBall, a, BodyId{}, {0, 0, 2.2}});
    world.add_joint({JointType::kBall, a, b, {0.25, 0, 2}});
    run(world, 3);
    const BodyState s = world.state(a);
    CHECK((s.position + s.rotation * Vec3(0, 0, 0.2) - Vec3(0, 0, 2.2)).norm() < 0.02);
}
