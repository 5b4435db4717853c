// Where the energy of a step goes: each cause against the mechanics of a scene that has it alone.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

WorldSettings diagnosed() {
    WorldSettings settings;
    settings.diagnostics = true;
    return settings;
}

// Sums over a run; checks in each step that the causes add up to what the world's energies changed by.
StepEnergy energy_of_run(World& world, Real duration) {
    StepEnergy sum;
    Real kinetic = world.kinetic_energy(), potential = world.potential_energy();
    const Real scale = std::abs(kinetic) + std::abs(potential) + 1;
    run(world, duration, kStep, [&](const StepReport& r) {
        const StepEnergy& e = r.diagnostics->energy;
        // Sums of energies, each with rounding of the largest.
        REQUIRE(std::abs(world.kinetic_energy() - kinetic - e.kinetic_change) < 1e-13 * scale);
        REQUIRE(std::abs(world.potential_energy() - potential - e.potential_change) < 1e-13 * scale);
        const Real causes = e.applied + e.driven + e.impacts + e.friction + e.joints + e.stabilisation + e.sleep + e.remainder;
        REQUIRE(std::abs(causes - e.total_change()) < 1e-13 * scale);
        REQUIRE(std::abs(causes + e.gravity - e.kinetic_change) < 1e-13 * scale);
        kinetic = world.kinetic_energy();
        potential = world.potential_energy();
        for (Real StepEnergy::*part : {&StepEnergy::kinetic_change, &StepEnergy::potential_change, &StepEnergy::gravity,
                                       &StepEnergy::applied, &StepEnergy::driven, &StepEnergy::impacts, &StepEnergy::friction,
                                       &StepEnergy::joints, &StepEnergy::stabilisation, &StepEnergy::sleep, &StepEnergy::remainder})
            sum.*part += e.*part;
    });
    return sum;
}

}  // namespace

TEST_CASE("in free fall all that the energy gains is the work of gravity") {
    World world(diagnosed());
    BodyDef b = cube(1, {0, 0, 10}, 3);
    b.linear_velocity = {1, 0, 2};
    world.add_body(b);
    const StepEnergy e = energy_of_run(world, 1);
    CHECK(std::abs(e.gravity + 3 * kG * (2 - kG / 2)) < 1e-11);
    CHECK(std::abs(e.kinetic_change - e.gravity) < 1e-11);  // a parabola is exact
    CHECK(std::abs(e.remainder) < 1e-11);
    CHECK(e.impacts == 0);
    CHECK(e.friction == 0);
    CHECK(e.joints == 0);
    CHECK(e.stabilisation == 0);
}

TEST_CASE("a ball that bounces loses one less the square of its restitution") {
    const Real restitution = GENERATE(0.0, 0.5, 1.0);
    CAPTURE(restitution);
    World world(diagnosed());
    world.add_body(ground(0.5, restitution));
    BodyDef b = ball(0.5, {0, 0, 1.5}, 2);
    world.add_body(b);
    const StepEnergy e = energy_of_run(world, 0.7);  // it arrives at 0.45 s; with e = 0.5 it is in the air until 0.9 s
    CHECK(std::abs(e.impacts + (1 - restitution * restitution) * 2 * kG) < 1e-3 * 2 * kG);
    CHECK(std::abs(e.friction) < 1e-12);
    CHECK(std::abs(e.remainder) < 1e-9);
}

TEST_CASE("a box that slides down a slope loses mu m g cos(alpha) a metre to friction") {
    const SolverChoice solver = GENERATE(SolverChoice::kSi, SolverChoice::kDirect);
    const Real alpha = 0.5, mu = 0.3, mass = 2;
    WorldSettings settings = diagnosed();
    settings.solver = solver;
    settings.gravity = {kG * std::sin(alpha), 0, -kG * std::cos(alpha)};
    World world(settings);
    world.add_body(ground(mu));
    const BodyId id = world.add_body(cube(1, {0, 0, 0.5}, mass, mu));
    const StepEnergy e = energy_of_run(world, 1);
    const Real way = world.state(id).position.x();
    CHECK(way > 0.9);  // a t²/2 with a = g (sin α − μ cos α) = 2.12 m/s²
    const Real friction = -mu * mass * kG * std::cos(alpha) * way;
    // Single solves leave 1e-4 m/s, which is a ten-thousandth of the speeds here; loads of the corners follow.
    CHECK(std::abs(e.friction - friction) < 1e-3 * std::abs(friction));
    CHECK(std::abs(e.impacts) < 1e-3 * std::abs(friction));
    CHECK(std::abs(e.remainder) < 1e-6 * std::abs(friction));
}

TEST_CASE("a pendulum keeps its energy to the error of the integration") {
    World world(diagnosed());
    const BodyId bob = world.add_body(cube(0.2, {1, 0, 0}, 3));
    world.add_joint({JointType::kHinge, bob, BodyId{}, Vec3::Zero(), Vec3::Zero(), Vec3::UnitY()});
    const StepEnergy e = energy_of_run(world, 2);
    // 4th order with Ω h of some 0.05: (Ω h)⁴ a swing, of the scale m g L.
    CHECK(std::abs(e.remainder) < 1e-5 * 3 * kG);
    CHECK(std::abs(e.joints) < 1e-9);
    CHECK(std::abs(e.stabilisation) < 1e-9);
    CHECK(e.friction == 0);
}

TEST_CASE("a stack at rest neither gains nor loses") {
    const SolverChoice solver = GENERATE(SolverChoice::kAuto, SolverChoice::kSi);
    WorldSettings settings = diagnosed();
    settings.solver = solver;
    World world(settings);
    world.add_body(ground());
    for (int k = 0; k < 5; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    run(world, 1);
    const StepEnergy e = energy_of_run(world, 1);
    // Of a scale of m g H = 123 J. What sweeps leave undone, 1e-4 m/s a solve, times what passes through a box in a step, 0.8 N s.
    const Real slack = solver == SolverChoice::kAuto ? 1e-9 : 60 * 1e-4;
    for (const Real part : {e.gravity, e.applied, e.driven, e.impacts, e.friction, e.joints, e.stabilisation, e.remainder})
        CHECK(std::abs(part) < slack);
}

TEST_CASE("a box that is pushed out of the ground owes its height to the stabilisation") {
    World world(diagnosed());
    world.add_body(ground());
    const BodyId id = world.add_body(cube(1, {0, 0, 0.45}, 2));
    const StepEnergy e = energy_of_run(world, 1);
    const Real lifted = 2 * kG * (world.state(id).position.z() - 0.45);
    CHECK(lifted > 0.8);
    // The last of it, at up to a thousandth of g h, is a velocity that the second solve takes away again, and so the work of normal rows.
    CHECK(std::abs(e.stabilisation - lifted) < 1e-2 * lifted);
    CHECK(std::abs(e.stabilisation + e.impacts - lifted) < 1e-6 * lifted);
    CHECK(std::abs(e.remainder) < 1e-6 * lifted);
}

TEST_CASE("a target velocity puts energy in, and is told as stabilisation") {
    WorldSettings settings = diagnosed();
    settings.stabilisation = Stabilisation::kTargetVelocity;
    settings.substeps = 1;
    settings.iterations = 2000;
    settings.residual_tolerance = 0;
    World world(settings);
    world.add_body(ground());
    world.add_body(cube(1, {0, 0, 0.45}, 2));
    const StepEnergy e = energy_of_run(world, kStep);
    // b = 0.2 · 0.05 m · 60/s = 0.6 m/s from rest: half the impulse m (b + g h) times b.
    CHECK(std::abs(e.stabilisation - 0.5 * 2 * (0.6 + kG * kStep) * 0.6) < 1e-9);
    CHECK(e.total_change() > 0.3);
}

TEST_CASE("half of what a moving floor puts in is lost in friction") {
    WorldSettings settings = diagnosed();
    World world(settings);
    BodyDef floor;
    floor.type = BodyType::kKinematic;
    floor.shapes = {Shape::box({20, 2, 0.5})};
    floor.position = {0, 0, -0.5};
    floor.linear_velocity = {2, 0, 0};
    world.add_body(floor);
    const BodyId id = world.add_body(cube(1, {0, 0, 0.5}, 3));
    const StepEnergy e = energy_of_run(world, 1);  // μ g t = 2 m/s after 0.41 s
    CHECK(std::abs(world.state(id).linear_velocity.x() - 2) < 1e-3);
    CHECK(std::abs(e.driven - 3 * 2 * 2) < 1e-2);
    CHECK(std::abs(e.friction + 0.5 * 3 * 2 * 2) < 1e-2);
    CHECK(std::abs(e.remainder) < 1e-6);
}

TEST_CASE("a force and a torque put in what they do on their way") {
    const bool touches = GENERATE(false, true);
    CAPTURE(touches);
    WorldSettings settings = diagnosed();
    if (!touches) settings.gravity.setZero();
    World world(settings);
    if (touches) world.add_body(ground(0));
    const BodyId id = world.add_body(cube(1, {0, 0, 0.5}, 2));
    world.set_force(id, {3, 0, 0}, {0, 0, 0.5});
    const StepEnergy e = energy_of_run(world, 1);
    // F²t²/2m + τ²t²/2I with I = m/6
    const Real work = 9.0 / 4 + 0.25 / (2 * 2.0 / 6);
    CHECK(std::abs(e.applied - work) < 1e-3 * work);
    CHECK(std::abs(e.kinetic_change - work) < 1e-3 * work);
    CHECK(std::abs(e.remainder) < 1e-3 * work);
}

TEST_CASE("joints that stop a body take its energy") {
    World world(diagnosed());
    BodyDef b = cube(0.2, {1, 0, 0}, 3);
    b.linear_velocity = {2, 0, 0};  // along the arm
    const BodyId bob = world.add_body(b);
    world.add_joint({JointType::kBall, bob, BodyId{}, Vec3::Zero()});
    const StepEnergy e = energy_of_run(world, kStep);
    CHECK(std::abs(e.joints + 0.5 * 3 * 4) < 1e-9);
}

TEST_CASE("what falls asleep gives up what it had left") {
    WorldSettings settings = diagnosed();
    settings.sleep = true;
    World world(settings);
    world.add_body(ground());
    const BodyId id = world.add_body(cube(1, {0, 0, 0.5}));
    Real slept = 0, before = 0;
    for (int k = 0; k < 300 && !world.is_sleeping(id); ++k) {
        before = world.kinetic_energy();
        slept = world.step(kStep).diagnostics->energy.sleep;
    }
    REQUIRE(world.is_sleeping(id));
    CHECK(slept <= 0);
    CHECK(std::abs(slept) <= before + 1e-12);
}

TEST_CASE("joints and contacts together: every cause is known") {
    World world(diagnosed());
    world.add_body(ground());
    BodyId previous;
    for (int k = 0; k < 5; ++k) {
        const BodyId next = world.add_body(body(Shape::capsule(0.1, 0.2), {0.7 * k, 0, 1}));
        if (k > 0) world.add_joint({JointType::kBall, next, previous, {0.7 * k - 0.35, 0, 1}});
        previous = next;
    }
    const StepEnergy e = energy_of_run(world, 2);
    const Real fallen = 5 * kG * 0.8;
    CHECK(e.impacts < -0.1 * fallen);
    // First solves carry half of the last substep's friction on, which the second ones correct: 1e-4 of it where directions change.
    CHECK(e.friction < 1e-3 * fallen);
    // The rotor's 2nd order in substeps of 1/120 s while the links tumble at some rad/s.
    CHECK(std::abs(e.remainder) < 1e-2 * fallen);
}
