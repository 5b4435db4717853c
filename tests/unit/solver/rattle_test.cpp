// RATTLE on hand-built islands: order, constraints, momenta, redundancy, refusal.
#include "solver/rattle.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

using namespace cairn;
using namespace cairn::solver_test;

namespace {

// A joint whose anchors meet at `p` and whose frames are the world's with `axis` first.
template <JointKind K>
void join(Island& island, int a, int b, const Vec3& p, const Vec3& axis = Vec3::UnitY()) {
    const BodyMotion &A = island.bodies.motion[a], &B = island.bodies.motion[b];
    Mat3 frame;
    frame << axis, any_perpendicular(axis), axis.cross(any_perpendicular(axis));
    JointGeometry g;
    g.anchor_a_A = A.R.transpose() * (p - A.x);
    g.anchor_b_B = B.R.transpose() * (p - B.x);
    g.frame_A = A.R.transpose() * frame;
    g.frame_B = B.R.transpose() * frame;
    add_joint<K>(island, a, b, g);
}

int add_rod(Island& island, const Vec3& x, Real mass = 1, const Vec3& w = Vec3::Zero()) {
    BodyMotion m = make_body(mass, make_rotor_inertia(mass * Vec3(0.02, 0.05, 0.06), Quat::Identity()), x, Quat::Identity());
    m.acceleration = {0, 0, -9.81};
    return island.add_body(m, {Vec3::Zero(), w});
}

// n rods in a row from the origin along x, on joints of kind K.
template <JointKind K>
Island chain(int n, Real end_mass = 1) {
    Island island;
    for (int i = 0; i < n; ++i) add_rod(island, {0.5 + i, 0, 0}, i + 1 == n ? end_mass : 1);
    for (int i = 0; i < n; ++i) join<K>(island, i == 0 ? 0 : i, i + 1, {static_cast<Real>(i), 0, 0});
    return island;
}

RattleReport step(Island& island, RattleWorkspace& workspace, Real dt, RattleSettings settings = {}) {
    settings.warm_step = dt / 4;
    return solve_island_rattle(workspace, island.bodies, island.joints, island.range, dt, settings);
}

void run(Island& island, Real duration, int steps, const RattleSettings& settings = {}) {
    RattleWorkspace workspace;
    for (int k = 0; k < steps; ++k) REQUIRE(step(island, workspace, duration / steps, settings).ok());
}

Real largest_gap(const Island& island) {
    Real gap = 0;
    for_each_listed_joint(island.joints, island.range.joints, [&](auto kind, const auto& j, int) {
        const BodyMotion &a = island.bodies.motion[j.a], &b = island.bodies.motion[j.b];
        gap = std::max(gap, joint_error<decltype(kind)::value>(j.geometry, {a.x, a.R}, {b.x, b.R}).cwiseAbs().maxCoeff());
    });
    return gap;
}

Real energy(const Island& island) {
    Real e = 0;
    for (int i = 1; i < island.bodies.size(); ++i) {
        const BodyMotion& m = island.bodies.motion[i];
        const BodyVelocity& u = island.bodies.velocity[i];
        e += (0.5 * u.v.squaredNorm() - m.acceleration.dot(m.x)) / m.inv_mass + 0.5 * u.w.dot(inertia_W(m) * u.w);
    }
    return e;
}

}  // namespace

TEST_CASE("a step of five stages is of 4th order, one of one stage of 2nd, on every joint that lets bodies turn") {
    const int order = GENERATE(2, 4);
    const int kind = GENERATE(0, 1, 2);
    CAPTURE(order, kind);
    const auto make = [&] {
        Island island = kind == 0 ? chain<JointKind::kBall>(3) : chain<JointKind::kHinge>(3);
        if (kind == 2) {  // a spinning top beside a rod
            island = chain<JointKind::kBall>(1);
            island.bodies.velocity[1].w = {20, 0, 0};
        }
        return island;
    };
    RattleSettings settings;
    settings.order = order;
    settings.substeps = 1;
    settings.tolerance = 1e-12;
    const auto end_of = [&](int steps) {
        Island island = make();
        run(island, 0.4, steps, settings);
        return island.bodies.motion.back().x;
    };
    const Vec3 truth = end_of(order == 4 ? 400 : 12800);
    const Real coarse = (end_of(order == 4 ? 20 : 50) - truth).norm(), fine = (end_of(order == 4 ? 40 : 100) - truth).norm();
    CAPTURE(coarse, fine);
    // 2^4 and 2^2 where the next terms of the error, some hω ≈ 0.1 of it, do not matter.
    CHECK(coarse / fine > (order == 4 ? 12 : 3.6));
    CHECK(coarse < (order == 4 ? 1e-4 : 1e-1));
}

TEST_CASE("joints of every kind hold to the tolerance and their velocities agree") {
    Random random(3);
    Island island;
    const int a = add_rod(island, {0, 0, 0}), b = add_rod(island, {1, 0, 0}), c = add_rod(island, {2, 0, 0}),
              d = add_rod(island, {3, 0, 0});
    join<JointKind::kHinge>(island, 0, a, {-0.5, 0, 0});
    join<JointKind::kSlider>(island, a, b, {0.5, 0.1, 0}, Vec3(1, 0, 1).normalized());
    join<JointKind::kFixed>(island, b, c, {1.5, 0, 0});
    JointGeometry rod;
    rod.anchor_a_A = {0, 0.2, 0};
    rod.length = (Vec3(3, 0, 0) - Vec3(2, 0.2, 0)).norm();
    add_joint<JointKind::kDistance>(island, c, d, rod);
    RattleWorkspace workspace;
    for (int k = 0; k < 120; ++k) {
        REQUIRE(step(island, workspace, 1.0 / 60).ok());
        // What SHAKE may leave, twice over for the angular rows that the bound does not count.
        REQUIRE(largest_gap(island) < 1e-8);
    }
    JointRowList rows;
    JointPlans plans;
    const JointPlan& plan = plans.find(island.joints, island.range.joints, island.bodies, 1, 1e9);
    rows.gather(island.joints, island.range.joints, island.bodies, plan);
    rows.build(island.joints, island.range.joints, island.bodies);
    std::vector<Real> u(rows.rows());
    rows.velocities(island.bodies, u.data());
    // One solve: rounding times the condition of A (below 1e3) of velocities of 10 m/s.
    for (Real r : u) CHECK(std::abs(r) < 1e-11);
}

TEST_CASE("without the world's hold the momenta stay what they are") {
    Island island;
    for (int i = 0; i < 4; ++i) add_rod(island, {static_cast<Real>(i), 0, 0}, 1 + i, Vec3(1, 2 - i, 0.5 * i));
    for (int i = 1; i < 4; ++i) join<JointKind::kBall>(island, i, i + 1, {i - 0.5, 0, 0});
    for (BodyMotion& m : island.bodies.motion) m.acceleration.setZero();
    RattleWorkspace workspace;
    REQUIRE(step(island, workspace, 1.0 / 60).ok());  // brings the velocities into agreement, with impulses that are internal too
    const Vec3 p = linear_momentum(island.bodies), L = angular_momentum(island.bodies);
    const Real E = energy(island);
    for (int k = 0; k < 300; ++k) REQUIRE(step(island, workspace, 1.0 / 60).ok());
    // Internal impulses act along one line at the start's anchors, which are together to 1e-9; they are some 1 N s a stage, 1500 stages,
    // of either sign.
    CHECK((linear_momentum(island.bodies) - p).norm() < 1e-11);
    CHECK((angular_momentum(island.bodies) - L).norm() < 1e-7);
    // 4th order and symplectic: the energy swings by some (hω)⁴ = (0.05)⁴.
    CHECK(std::abs(energy(island) - E) < 1e-4 * E);
}

TEST_CASE("a closed chain of four hinges, whose rows are redundant, keeps closed and keeps its energy") {
    // A parallelogram: three rods between two hinges on the world. In the plane it has one freedom, in space three rows too many.
    Island island;
    const int left = add_rod(island, {0.3, 0, -0.4}), top = add_rod(island, {1.1, 0, -0.8}), right = add_rod(island, {1.3, 0, -0.4});
    join<JointKind::kHinge>(island, 0, left, {0, 0, 0});
    join<JointKind::kHinge>(island, left, top, {0.6, 0, -0.8});
    join<JointKind::kHinge>(island, top, right, {1.6, 0, -0.8});
    join<JointKind::kHinge>(island, right, 0, {1, 0, 0});
    RattleWorkspace workspace;
    const Real E = energy(island);
    Real swing = 0;
    int dropped = 0;
    for (int k = 0; k < 600; ++k) {
        const RattleReport r = step(island, workspace, 1.0 / 60);
        CAPTURE(k, to_string(r.failure));
        REQUIRE(r.ok());
        dropped = std::max(dropped, r.dropped_rows);
        swing = std::max(swing, std::abs(energy(island) - E));
        REQUIRE(largest_gap(island) < 1e-7);
    }
    CHECK(dropped == 3);
    CHECK(swing < 1e-4 * 3 * 9.81);
    CHECK(std::abs(island.bodies.motion[top].R(1, 1) - 1) < 1e-9);  // stays in its plane
}

TEST_CASE("the same joint twice weighs as one") {
    Island once = chain<JointKind::kBall>(2), twice = chain<JointKind::kBall>(2);
    join<JointKind::kBall>(twice, 1, 2, {1, 0, 0});
    run(once, 1, 60);
    run(twice, 1, 60);
    // Both to the tolerance of SHAKE, over 60 steps of 5 stages.
    CHECK((once.bodies.motion[2].x - twice.bodies.motion[2].x).norm() < 1e-5);
}

TEST_CASE("a chain under a thousand times its links' mass does not stretch") {
    Island island = chain<JointKind::kBall>(20, 1000);
    RattleWorkspace workspace;
    for (int k = 0; k < 60; ++k) {
        const RattleReport r = step(island, workspace, 1.0 / 60);
        CAPTURE(k, to_string(r.failure));
        REQUIRE(r.ok());
        REQUIRE(largest_gap(island) < 1e-7);
    }
}

TEST_CASE("joints that start apart glide together and gain no speed from it") {
    Island island = chain<JointKind::kBall>(3);
    for (BodyMotion& m : island.bodies.motion) m.acceleration.setZero();
    island.bodies.motion[2].x += Vec3(0.3, 0.4, 0);
    RattleWorkspace workspace;
    Real gap = largest_gap(island);
    for (int k = 0; k < 120; ++k) {
        REQUIRE(step(island, workspace, 1.0 / 60).ok());
        REQUIRE(largest_gap(island) < gap + 1e-9);
        gap = largest_gap(island);
        for (int i = 1; i <= 3; ++i) REQUIRE(island.bodies.velocity[i].v.norm() < 1e-6);
    }
    // Half a metre at 1 m/s in two seconds.
    CHECK(gap < 1e-7);
}

TEST_CASE("what RATTLE cannot take it refuses, with bodies and joints as they were") {
    Island island = chain<JointKind::kBall>(3);
    RattleWorkspace workspace;
    REQUIRE(step(island, workspace, 1.0 / 60).ok());
    RattleSettings settings;
    SECTION("too costly") {
        settings.max_flops = 10;
        RattleWorkspace other;
        const SolverBodies before = island.bodies;
        CHECK(step(island, other, 1.0 / 60, settings).failure == RattleFailure::kTooCostly);
        CHECK(island.bodies.motion[3].x == before.motion[3].x);
    }
    SECTION("contacts") {
        island.add_contact(1, 0, Vec3::UnitZ(), NormalFrame::kWorld, std::vector<PointGeometry>(1), 0);
        CHECK(step(island, workspace, 1.0 / 60).failure == RattleFailure::kHasContacts);
    }
    SECTION("velocities beyond reach") {
        island.bodies.velocity[2].w = {1e200, 0, 0};
        const SolverBodies before = island.bodies;
        const VecN<3> warm = island.joints.ball[0].warm_first;
        CHECK_FALSE(step(island, workspace, 1.0 / 60).ok());
        for (int i = 1; i <= 3; ++i) {
            CHECK(island.bodies.motion[i].x == before.motion[i].x);
            CHECK(island.bodies.motion[i].q.coeffs() == before.motion[i].q.coeffs());
            CHECK(island.bodies.velocity[i].w == before.velocity[i].w);
        }
        CHECK(island.joints.ball[0].warm_first == warm);
    }
}

TEST_CASE("a step is a function of the state: another workspace gives the same bits") {
    Island island = chain<JointKind::kHinge>(5), same = chain<JointKind::kHinge>(5);
    RattleWorkspace kept;
    Island other = chain<JointKind::kBall>(9);
    for (int k = 0; k < 30; ++k) {
        RattleWorkspace fresh;
        REQUIRE(step(island, kept, 1.0 / 60).ok());
        REQUIRE(step(other, kept, 1.0 / 60).ok());
        REQUIRE(step(same, fresh, 1.0 / 60).ok());
    }
    for (int i = 1; i <= 5; ++i) {
        CHECK(island.bodies.motion[i].x == same.bodies.motion[i].x);
        CHECK(island.bodies.velocity[i].w == same.bodies.velocity[i].w);
    }
}
