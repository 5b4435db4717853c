// What solves add to the kinetic energy, and how it is taken back.
#include "solver/energy_gain.hpp"

#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

using namespace cairn;
using namespace cairn::solver_test;

namespace {

BodyVelocity random_velocity(Random& random, Real size = 1) {
    const Vec3 v = random_vector(random, size), w = random_vector(random, size);
    return {v, w};
}

// Bodies 1 … count whose velocities were noted before they changed.
SolverBodies changed_bodies(Random& random, int count, Real change) {
    Island island;
    for (int i = 0; i < count; ++i) island.add_body(random_body(random), random_velocity(random));
    SolverBodies bodies = island.bodies;
    bodies.push.resize(bodies.velocity.size());
    bodies.gain.resize(bodies.velocity.size());
    begin_push(bodies, 1, bodies.size());
    for (int i = 1; i < bodies.size(); ++i) {
        const BodyVelocity d = random_velocity(random, change);
        bodies.velocity[i] = {bodies.velocity[i].v + d.v, bodies.velocity[i].w + d.w};
    }
    return bodies;
}

Real gain_of_all(SolverBodies& bodies) {
    measure_gain(bodies, 1, bodies.size());
    return gain_of(bodies, 1, bodies.size()).sum;
}

}  // namespace

TEST_CASE("the product of two velocities of a body is aᵀ M b") {
    Random random(1);
    const Vec3 moments = GENERATE(Vec3(0.4, 0.4, 0.4), Vec3(0.4, 0.4, 0.7), Vec3(0.4, 0.5, 0.7));
    const bool aligned = GENERATE(false, true);
    const Quat R_BP = aligned ? Quat(Quat::Identity()) : random_rotation(random);
    const BodyMotion body = make_body(2, make_rotor_inertia(moments, R_BP), Vec3::Zero(), random_rotation(random));
    const BodyVelocity a = random_velocity(random), b = random_velocity(random);
    CHECK(kinetic_product(body, a, b) == Approx(2 * a.v.dot(b.v) + a.w.dot(inertia_W(body) * b.w)).epsilon(1e-12));
}

TEST_CASE("the gain of bodies is the kinetic energy after less that before") {
    Random random(2);
    SolverBodies bodies = changed_bodies(random, 5, 0.3);
    Real difference = 0;
    for (int i = 1; i < bodies.size(); ++i) {
        const BodyMotion& m = bodies.motion[i];
        const BodyVelocity &u = bodies.velocity[i], &before = bodies.push[i];
        difference += 0.5 * (kinetic_product(m, u, u) - kinetic_product(m, before, before));
    }
    CHECK(gain_of_all(bodies) == Approx(difference).epsilon(1e-12));
}

TEST_CASE("a gain of rounding is none") {
    CHECK_FALSE(EnergyGain{1e-14, 1}.is_gain());
    CHECK(EnergyGain{1e-10, 1}.is_gain());
    CHECK_FALSE(EnergyGain{-1, 1}.is_gain());
    CHECK_FALSE((EnergyGain{1, 1} + EnergyGain{-1.5, 2}).is_gain());
}

TEST_CASE("of changes that gain energy the share is kept with which they do not") {
    const unsigned seed = GENERATE(range(1u, 9u));
    CAPTURE(seed);
    Random random(seed);
    SolverBodies bodies = changed_bodies(random, 4, 2);
    const Real all = gain_of_all(bodies);
    REQUIRE(all > 0);
    SECTION("together with what was lost before") {
        const Real lost = 0.3 * all;
        keep_share(bodies, 1, bodies.size(), lossless_share(bodies, 1, bodies.size(), -lost));
        CHECK(gain_of_all(bodies) == Approx(lost).epsilon(1e-9));
    }
    SECTION("all, if more was lost before") {
        CHECK(lossless_share(bodies, 1, bodies.size(), -1.01 * all) == 1);
    }
    SECTION("that with the least, if none does") {
        const Real share = lossless_share(bodies, 1, bodies.size(), 1e6);
        const auto gain_at = [&](Real s) {
            SolverBodies copy = bodies;
            keep_share(copy, 1, copy.size(), s);
            return gain_of_all(copy);
        };
        const Real least = gain_at(share);
        for (Real s = 0; s <= 1; s += 0.05) CHECK(gain_at(s) >= least - 1e-12 * all);
    }
}

TEST_CASE("nothing that changed is kept as it is") {
    Random random(4);
    const SolverBodies bodies = changed_bodies(random, 3, 0);
    CHECK(lossless_share(bodies, 1, bodies.size(), 1) == 1);
}
