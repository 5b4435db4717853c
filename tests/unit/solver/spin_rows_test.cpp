#include "solver/spin_rows.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <Eigen/Eigenvalues>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

// Two bodies, one contact point between them, and a row of both frictions.
struct Pair {
    SolverBodies bodies;
    ContactPool pool;
    static constexpr BlockRange kOne{0, 1};

    explicit Pair(Random& random) {
        bodies.motion = {BodyMotion(), random_body(random), random_body(random)};
        bodies.velocity.resize(3);
        for (int i : {1, 2}) bodies.velocity[i].w = random_vector(random, 3);
        ContactBlock block;
        block.a = 1, block.b = 2, block.count = 1;
        block.n = random_direction(random);
        block.inv_mass_a = bodies.motion[1].inv_mass, block.inv_mass_b = bodies.motion[2].inv_mass;
        pool.make_room(0, 1, 0);
        pool.point_count = 1;
        pool.blocks.push_back(block);
        SpinRow row;
        row.torsional = uniform(random, 0.01, 0.1);
        row.rolling = uniform(random, 0.01, 0.1);
        pool.spins.push_back(row);
        build_spins(pool, kOne, bodies);
    }
    const Vec3& n() const { return pool.blocks[0].n; }
    Vec3 turning() const { return bodies.velocity[1].w - bodies.velocity[2].w; }
    void press(Real impulse) { pool.impulse[0].normal = impulse; }
};

}  // namespace

TEST_CASE("the masses of torsion and rolling are those of dense algebra") {
    Random random(11);
    for (int k = 0; k < 1000; ++k) {
        const Pair pair(random);
        const SpinRow& row = pair.pool.spins[0];
        const Mat3 K = inertia_W(pair.bodies.motion[1]).inverse() + inertia_W(pair.bodies.motion[2]).inverse();
        const Mat3 across = Mat3::Identity() - pair.n() * pair.n().transpose();
        const Vec3 eigenvalues = Eigen::SelfAdjointEigenSolver<Mat3>(across * K * across).eigenvalues();
        REQUIRE(std::abs(row.torsion_mass * pair.n().dot(K * pair.n()) - 1) < 1e-12);
        REQUIRE(std::abs(row.rolling_mass * eigenvalues.maxCoeff() - 1) < 1e-12);
        REQUIRE((row.response - K).norm() < 1e-12 * K.norm());
    }
}

TEST_CASE("sweeps stop all turning where the load is large, within the bounds where it is not, and keep the angular momentum") {
    Random random(12);
    for (int k = 0; k < 100; ++k) {
        Pair pair(random);
        const auto momentum = [&] {
            return Vec3(inertia_W(pair.bodies.motion[1]) * pair.bodies.velocity[1].w +
                        inertia_W(pair.bodies.motion[2]) * pair.bodies.velocity[2].w);
        };
        const Vec3 before = momentum();
        const bool firm = k % 2 == 0;
        pair.press(firm ? 1e4 : 0.5);
        // Moments at most 1 : 11 apart: a sweep leaves 10/11 of the slowest part of rolling, or less.
        for (int sweep = 0; sweep < 600; ++sweep) sweep_spins(pair.pool, Pair::kOne, pair.bodies);
        const SpinRow& row = pair.pool.spins[0];
        const Real torsion = pair.n().dot(row.impulse);
        const Vec3 rolling = row.impulse - torsion * pair.n();
        REQUIRE((momentum() - before).norm() < 1e-11 * before.norm());
        if (firm) {
            REQUIRE(pair.turning().norm() < 1e-11);
            continue;
        }
        const Real load = 0.5;
        REQUIRE(std::abs(torsion) <= row.torsional * load * (1 + 1e-12));
        REQUIRE(rolling.norm() <= row.rolling * load * (1 + 1e-12));
        // At its bound the moment opposes the rolling.
        const Vec3 w = pair.turning() - pair.n() * pair.n().dot(pair.turning());
        if (rolling.norm() > 0.999 * row.rolling * load) REQUIRE(rolling.normalized().dot(w.normalized()) < -1 + 1e-9);
    }
}
