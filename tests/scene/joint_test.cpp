// Joints against closed forms.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

// Period of a pendulum of amplitude a: T = 2π sqrt(I / m g d) / agm(1, cos(a/2)) (Gauss).
Real pendulum_period(Real inertia_over_mgd, Real amplitude) {
    Real x = 1, y = std::cos(amplitude / 2);
    for (int k = 0; k < 30; ++k) {
        const Real mean = (x + y) / 2;
        y = std::sqrt(x * y);
        x = mean;
    }
    return 2 * kPi * std::sqrt(inertia_over_mgd) / x;
}

}  // namespace

TEST_CASE("a pendulum has the period of the elliptic integral and keeps its energy") {
    const JointType type = GENERATE(JointType::kBall, JointType::kHinge, JointType::kDistance);
    const Real amplitude = GENERATE(0.2, 1.5);
    CAPTURE(to_string(type), amplitude);
    // A rod of length d with a heavy ball of radius ρ at its end. Held by its centre (distance) it does not turn.
    const Real d = 1.2, rho = 0.2;
    const Real inertia = type == JointType::kDistance ? d * d : d * d + 0.4 * rho * rho;
    World world;
    const Vec3 start(d * std::sin(amplitude), 0, -d * std::cos(amplitude));
    const BodyId id = world.add_body(ball(rho, start, 2));
    const bool rod = type == JointType::kDistance;
    world.add_joint({type, id, BodyId{}, rod ? start : Vec3(Vec3::Zero()), Vec3::Zero(), Vec3::UnitY()});
    const Real E = world.potential_energy();
    const Real swing = 2 * kG * d * (1 - std::cos(amplitude));  // [J], m = 2
    const Real truth = pendulum_period(inertia / (kG * d), amplitude);

    const Real dt = 1.0 / 240;
    Real last = 0, first_crossing = -1, periods = 0, energy_error = 0, x = start.x();
    for (int k = 1; k * dt < 6 * truth; ++k) {
        world.step(dt);
        const Real now = world.state(id).position.x();
        if (x > 0 && now <= 0) {
            const Real t = (k - 1 + x / (x - now)) * dt;
            if (first_crossing < 0)
                first_crossing = t;
            else
                ++periods;
            last = t;
        }
        x = now;
        energy_error = std::max(energy_error, std::abs(world.kinetic_energy() + world.potential_energy() - E));
        REQUIRE(std::abs(world.state(id).position.norm() - d) < 1e-4 * d);
    }
    REQUIRE(periods >= 4);
    // 2nd order in h ω with h = dt / substeps: (2.9 / 960)² / 24 and likewise for the energy.
    CHECK(std::abs((last - first_crossing) / periods / truth - 1) < 1e-5);
    CHECK(energy_error < 1e-4 * swing);
}

TEST_CASE("a box on a slanted slider accelerates with g sinθ along it and leaves it nowhere") {
    const Real angle = GENERATE(0.3, 1.0, kPi / 2);
    World world;
    const Vec3 down(std::cos(angle), 0, -std::sin(angle));
    BodyDef def = cube(0.4, {0, 0, 0}, 2);
    const BodyId id = world.add_body(def);
    const JointId joint = world.add_joint({JointType::kSlider, id, BodyId{}, {0.1, 0.1, 0}, Vec3::Zero(), down});
    run(world, 1);
    // Along the slider nothing acts but gravity: exact. Across it the rows hold within their tolerance.
    const Vec3 p = world.state(id).position;
    CHECK(std::abs(p.dot(down) / (kG * std::sin(angle) / 2) - 1) < 1e-6);
    CHECK((p - down * down.dot(p)).norm() < 1e-5);
    CHECK(world.joint_error(joint).position < 1e-5);
    CHECK(world.joint_error(joint).angle < 1e-5);
}

TEST_CASE("a fixed joint carries a body as if both were one") {
    World world(no_gravity());
    BodyDef def = cube(0.5, {0, 0, 0}, 1);
    def.linear_velocity = {1, 0, 0};
    const BodyId a = world.add_body(def);
    def.position = {0.6, 0, 0};
    const BodyId b = world.add_body(def);
    const JointId joint = world.add_joint({JointType::kFixed, a, b, {0.3, 0, 0}});
    world.apply_impulse(b, {0, 0, 2}, {0.6, 0, 0});
    const Vec3 L = angular_momentum(world);
    run(world, 2);
    // Both masses: 2 kg; about the common centre I = 2 (m s²/6 + m 0.3²).
    const Real inertia = 2 * (0.25 / 6 + 0.09);
    const Real spin = -2 * 0.3 / inertia;
    CHECK((linear_momentum(world) - Vec3(2, 0, 2)).norm() < 1e-9);
    CHECK((angular_momentum(world) - L).norm() < 1e-3 * L.norm());
    CHECK((world.state(a).angular_velocity - Vec3(0, spin, 0)).norm() < 1e-3 * std::abs(spin));
    CHECK((world.state(b).angular_velocity - Vec3(0, spin, 0)).norm() < 1e-3 * std::abs(spin));
    CHECK(world.joint_error(joint).position < 1e-3);
    CHECK(world.joint_error(joint).angle < 1e-3);
}

TEST_CASE("a distance joint is a rigid rod") {
    World world(no_gravity());
    BodyDef def = ball(0.1, {0, 0, 0}, 1);
    def.linear_velocity = {0, 1, 0};
    const BodyId a = world.add_body(def);
    def.position = {1, 0, 0};
    def.linear_velocity = {0, -1, 0};
    const BodyId b = world.add_body(def);
    world.add_joint({JointType::kDistance, a, b, {0, 0, 0}, {1, 0, 0}});
    run(world, 2 * kPi * 0.5);  // one turn at ω = 2 v / d = 2 rad/s, to the nearest step
    const Real t = world.time();
    const Vec3 arm = world.state(b).position - world.state(a).position;
    CHECK(std::abs(arm.norm() - 1) < 1e-4);
    CHECK((arm - Vec3(std::cos(2 * t), -std::sin(2 * t), 0)).norm() < 1e-3);
    CHECK(linear_momentum(world).norm() < 1e-12);
    CHECK(std::abs(world.kinetic_energy() - 1) < 1e-4);
}
