// Bodies that nothing touches.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

TEST_CASE("a thrown body flies the parabola exactly, at any step") {
    const Real dt = GENERATE(1.0 / 240, 1.0 / 60, 1.0 / 7);
    CAPTURE(dt);
    World world;
    BodyDef def = body(Shape::box({0.3, 0.2, 0.1}), {1, -2, 10}, 2.5);
    def.linear_velocity = {3, 4, 5};
    def.angular_velocity = {1, 2, 3};
    const BodyId id = world.add_body(def);
    const int steps = static_cast<int>(2 / dt);
    for (int k = 1; k <= steps; ++k) {
        world.step(dt);
        const Real t = k * dt;
        const Vec3 truth(1 + 3 * t, -2 + 4 * t, 10 + 5 * t - kG * t * t / 2);
        REQUIRE((world.state(id).position - truth).norm() < 1e-12);
        REQUIRE((world.state(id).linear_velocity - Vec3(3, 4, 5 - kG * t)).norm() < 1e-12);
    }
}

TEST_CASE("a free asymmetric body keeps its angular momentum, and its energy to the order of the method") {
    const Vec3 spin = GENERATE(Vec3(5, 0.01, 0), Vec3(0.01, 5, 0), Vec3(3, -2, 4));
    World world(no_gravity());
    BodyDef def = body(Shape::box({0.5, 0.3, 0.1}), {0, 0, 0}, 2);
    def.rotation = turn({1, 1, 0}, 0.5);
    def.angular_velocity = spin;
    world.add_body(def);
    const Vec3 L = angular_momentum(world);
    const Real E = world.kinetic_energy();
    Real energy_error = 0;
    for (int k = 0; k < 600; ++k) {
        world.step(kStep);
        energy_error = std::max(energy_error, std::abs(world.kinetic_energy() / E - 1));
    }
    // L = R L_P is transported by rotations alone: 600 steps of rounding.
    CHECK((angular_momentum(world) - L).norm() < 1e-12 * L.norm());
    // 4th order in ω dt = 0.09: 7e-5 times a small coefficient.
    CHECK(energy_error < 1e-6);
}

TEST_CASE("a symmetric top precesses at L / I⊥") {
    World world(no_gravity());
    BodyDef def = body(Shape::cylinder(0.4, 0.1), {0, 0, 0}, 3);
    def.angular_velocity = {2, 0, 9};
    const BodyId id = world.add_body(def);
    const Vec3 L = angular_momentum(world);
    const Mat3 I = world.inertia(id);
    const Real rate = L.norm() / I(0, 0);
    const int steps = 300;
    for (int k = 0; k < steps; ++k) world.step(kStep);
    // The axis turns about L by rate · t.
    const Vec3 axis = world.state(id).rotation * Vec3::UnitZ(), truth = turn(L, rate * steps * kStep) * Vec3::UnitZ();
    CHECK((axis - truth).norm() < 1e-10);  // exact flow: 300 steps of rounding
}
