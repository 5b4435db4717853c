#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

using namespace cairn;
using namespace cairn::solver_test;

namespace {

// Verlet's step of body 1.
void step(SolverBodies& bodies, Real h) {
    kick(bodies, 1, 2, 0.5 * h);
    drift(bodies, 1, 2, h);
    kick(bodies, 1, 2, 0.5 * h);
}

}  // namespace

TEST_CASE("a body under constant acceleration follows its parabola to rounding whatever the steps") {
    Random random(1);
    for (int i = 0; i < 20; ++i) {
        Island island;
        BodyMotion motion = random_body(random);
        motion.acceleration = random_vector(random, 10);
        const Vec3 x = motion.x, v = random_vector(random, 3), a = motion.acceleration;
        island.add_body(motion, {v, Vec3::Zero()});
        Real time = 0;
        for (int k = 0; k < 100; ++k) {
            const Real h = uniform(random, 0.001, 0.02);
            step(island.bodies, h);
            time += h;
        }
        // 100 steps round x (below 40 m: 4e-15 a time) and v (below 25 m/s, over 2 s: the same) once or twice each, at random.
        CHECK((island.bodies.motion[1].x - (x + time * v + 0.5 * time * time * a)).norm() < 2e-13);
        CHECK((island.bodies.velocity[1].v - (v + time * a)).norm() < 2e-13);
        CHECK(island.bodies.motion[1].q.coeffs() == motion.q.coeffs());
    }
}

TEST_CASE("a constant torque about a principal axis spins a body up by half the angular acceleration times the time squared") {
    const int k = GENERATE(0, 1, 2);
    const bool spherical = GENERATE(false, true);
    CAPTURE(k, spherical);
    Random random(2);
    const Vec3 moments = spherical ? Vec3::Constant(0.7) : random_moments(random, 1);
    BodyMotion motion = make_body(2, make_rotor_inertia(moments, random_rotation(random)), random_vector(random), random_rotation(random));
    const Vec3 axis = motion.q * (motion.rotor.R_BP * Vec3::Unit(k));
    const Real torque = 0.3, rate = torque / moments[k];
    motion.torque = torque * axis;
    Island island;
    island.add_body(motion, {});
    const int steps = 200;
    const Real h = 0.01, time = steps * h;
    for (int i = 0; i < steps; ++i) step(island.bodies, h);
    // Each step rounds w and q by a few 1e-16; a w that is off axis by that turns the axis by as much times the time.
    CHECK((island.bodies.velocity[1].w - rate * time * axis).norm() < 1e-12);
    const Quat expected = exp_rotation(0.5 * rate * time * time * axis) * motion.q;
    CHECK((island.bodies.motion[1].q.conjugate() * expected).vec().norm() < 1e-12);
}

TEST_CASE("after a drift the matrix, the world tensor and the turn of a body belong to its pose") {
    Random random(3);
    Real worst = 0;
    for (int i = 0; i < 100; ++i) {
        Island island;
        const Vec3 moments = i % 3 == 0 ? Vec3::Constant(0.4) : i % 3 == 1 ? Vec3(0.4, 0.4, 0.7) : random_moments(random, 2);
        const RotorInertia rotor = make_rotor_inertia(moments, random_rotation(random));
        island.add_body(make_body(2, rotor, random_vector(random), random_rotation(random)),
                        {random_vector(random), random_vector(random, 5)});
        const BodyVelocity start = island.bodies.velocity[1];
        const Vec3 x = island.bodies.motion[1].x;
        const int rotors = drift(island.bodies, 1, 2, 0.1);
        const BodyMotion& m = island.bodies.motion[1];
        CHECK(rotors == (i % 3 == 0 ? 0 : 1));
        CHECK(m.turned == Approx(0.1 * start.w.norm()).epsilon(1e-15));
        CHECK((m.x - (x + 0.1 * start.v)).norm() < 1e-15);
        CHECK(std::abs(m.q.norm() - 1) < 4e-16);
        worst = std::max(worst, (m.R - m.q.toRotationMatrix()).norm());
        worst = std::max(worst, (m.inv_inertia_W * inertia_W(m) - Mat3::Identity()).norm());
    }
    CHECK(worst < 1e-14);  // two dozen roundings of products at a condition of 4
}

TEST_CASE("kinematic bodies keep their velocities and turn about a fixed axis") {
    Random random(4);
    Island island;
    const Vec3 v = random_vector(random), w = random_vector(random, 3), x = random_vector(random);
    const Quat q = random_rotation(random);
    island.add_body(immovable_body(x, q), {v, w});
    for (int k = 0; k < 100; ++k) drift_kinematic(island.bodies, 1, 2, 0.01);
    const BodyMotion& m = island.bodies.motion[1];
    // 100 steps of a few roundings.
    CHECK((m.x - (x + v)).norm() < 1e-13);
    CHECK((m.q.conjugate() * exp_rotation(w) * q).vec().norm() < 1e-13);
    CHECK((m.R - m.q.toRotationMatrix()).norm() < 1e-15);
    CHECK(m.turned == Approx(w.norm()).epsilon(1e-13));
    CHECK(island.bodies.velocity[1].v == v);
    CHECK(island.bodies.velocity[1].w == w);
}

TEST_CASE("kick and drift leave bodies outside their range alone") {
    Island island;
    Random random(5);
    for (int i = 0; i < 3; ++i) {
        BodyMotion motion = random_body(random);
        motion.acceleration = Vec3::UnitX();
        motion.torque = Vec3::UnitY();
        island.add_body(motion, {Vec3::UnitX(), Vec3::UnitZ()});
    }
    const SolverBodies before = island.bodies;
    kick(island.bodies, 2, 3, 0.1);
    drift(island.bodies, 2, 3, 0.1);
    for (const int i : {0, 1, 3}) {
        CHECK(island.bodies.velocity[i].v == before.velocity[i].v);
        CHECK(island.bodies.velocity[i].w == before.velocity[i].w);
        CHECK(island.bodies.motion[i].x == before.motion[i].x);
        CHECK(island.bodies.motion[i].q.coeffs() == before.motion[i].q.coeffs());
    }
    CHECK(island.bodies.motion[2].x != before.motion[2].x);
}
