#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <limits>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

constexpr Real kGravity = 9.81;

// Every sweep, and rows that are rebuilt at every pose: what is left is the method.
SiSettings thorough(int iterations, int substeps = 1) {
    SiSettings settings;
    settings.iterations = iterations;
    settings.substeps = substeps;
    settings.residual_tolerance = 0;
    settings.rebuild_angle = -1;
    return settings;
}

// G v of a contact row.
Real row_velocity(const Island& island, const ContactBlock& block, const Vec3& direction, const PointRow& row) {
    const BodyVelocity &a = island.bodies.velocity[block.a], &b = island.bodies.velocity[block.b];
    return direction.dot(a.v - b.v) + row.ang_a.dot(a.w) - row.ang_b.dot(b.w);
}

// A ball at rest on the plane z = 0.
constexpr Real kBallMass = 3;
Island resting_ball() {
    const Real radius = 0.5;
    Island island;
    BodyMotion motion =
        make_body(kBallMass, make_rotor_inertia(Vec3::Constant(0.3), Quat::Identity()), Vec3(0.1, 0.2, radius), Quat::Identity());
    motion.acceleration = Vec3(0, 0, -kGravity);
    const int ball = island.add_body(motion, {});
    PointGeometry point;
    point.radius_a = radius;
    point.core_b_B = Vec3(0.1, 0.2, 0);
    island.add_contact(ball, kImmovable, Vec3::UnitZ(), NormalFrame::kWorld, {point}, 0.5);
    return island;
}

// A body on up to three points over the plane z = 0, thrown at random; some points above the plane, some in it.
Island thrown_body(Random& random, int points, Real mu) {
    Island island;
    BodyMotion motion = random_body(random);
    motion.x = Vec3(0, 0, 0.5);
    motion.acceleration = Vec3(0, 0, -kGravity);
    const int body = island.add_body(motion, {random_vector(random), random_vector(random)});
    std::vector<PointGeometry> geometry(points);
    for (int k = 0; k < points; ++k) {
        const Real angle = 2 * kPi * k / 3 + uniform(random, -0.5, 0.5);
        const Vec3 on_plane(0.6 * std::cos(angle), 0.6 * std::sin(angle), 0);
        const Real separation = uniform(random, -0.002, 0.02);
        geometry[k].core_a_A = motion.R.transpose() * (on_plane + Vec3(0, 0, separation) - motion.x);
        geometry[k].core_b_B = on_plane;
    }
    island.add_contact(body, kImmovable, Vec3::UnitZ(), NormalFrame::kB, geometry, mu);
    return island;
}

// Two bodies that touch in a point and come together, or overlap less than they will.
Island colliding_pair(Random& random, Real mu) {
    Island island;
    const int a = island.add_body(random_body(random), {}), b = island.add_body(random_body(random), {});
    const Vec3 n = random_direction(random), p = random_vector(random);
    PointGeometry point;
    point.core_a_A = island.bodies.motion[a].R.transpose() * (p - island.bodies.motion[a].x);
    point.core_b_B = island.bodies.motion[b].R.transpose() * (p - island.bodies.motion[b].x);
    for (const int i : {a, b}) island.bodies.velocity[i] = {random_vector(random), random_vector(random)};
    // Whatever the rotation does, the points come together at 1 m/s at least.
    const auto point_velocity = [&](int i) -> Vec3 {
        return island.bodies.velocity[i].v + island.bodies.velocity[i].w.cross(p - island.bodies.motion[i].x);
    };
    const Real approach = -n.dot(point_velocity(a) - point_velocity(b));
    island.bodies.velocity[a].v -= (1 - std::min(approach, 1.0)) * n;
    island.add_contact(a, b, n, NormalFrame::kWorld, {point}, mu);
    return island;
}

template <JointKind K>
Island jointed_pair(Random& random) {
    Island island;
    const int a = island.add_body(random_body(random), {random_vector(random), random_vector(random)});
    const int b = island.add_body(random_body(random), {random_vector(random), random_vector(random)});
    const BodyMotion &ma = island.bodies.motion[a], &mb = island.bodies.motion[b];
    const Vec3 offset = K == JointKind::kDistance ? random_direction(random) : Vec3(Vec3::Zero());
    add_joint<K>(island, a, b, joint_between(random, {ma.x, ma.R}, {mb.x, mb.R}, offset, Quat::Identity()));
    return island;
}

template <JointKind K>
void check_joint_momentum() {
    const int seed = GENERATE(range(0, 20));
    CAPTURE(seed);
    Random random(seed);
    Island island = jointed_pair<K>(random);
    const Vec3 before = linear_momentum(island.bodies);
    const SiSettings settings = thorough(1, 2);
    Real impulse = 0;
    for (int k = 0; k < 20; ++k) {
        island.step(0.005, settings);
        const JointBlock<joint_rows(K)>& joint = pool_of<K>(island.joints)[0];
        // A lone joint is solved to rounding by one sweep: G v = 0 and C stays near zero.
        VecN<joint_rows(K)> rate = joint.G_a.template leftCols<3>() * island.bodies.velocity[1].v;
        rate += joint.G_a.template rightCols<3>() * island.bodies.velocity[1].w;
        rate += joint.G_b.template leftCols<3>() * island.bodies.velocity[2].v;
        rate += joint.G_b.template rightCols<3>() * island.bodies.velocity[2].w;
        CHECK(rate.norm() < 1e-12);  // rounding of a few m/s times the condition of S, below a thousand
        // First the velocities jump, then the drift leaves (h w)² h a of it: h = 2.5 ms, w of a few rad/s, a of some tens of m/s².
        const BodyMotion &a = island.bodies.motion[1], &b = island.bodies.motion[2];
        if (k > 1) CHECK(joint_error<K>(joint.geometry, {a.x, a.R}, {b.x, b.R}).norm() < 1e-5);
        impulse = std::max(impulse, joint.total.norm());
    }
    CHECK(impulse > 1e-3);  // the joint has something to do
    // Impulses act on A and B with the same numbers and opposite signs: what is left is rounding, 40 substeps of three impulses each
    // of momenta below 30 N s (4e-15).
    CHECK((linear_momentum(island.bodies) - before).norm() < 4e-13);
}

}  // namespace

TEST_CASE("a ball at rest on the ground is given its weight times the step, and stays") {
    const SiStabilisation stabilisation = GENERATE(SiStabilisation::kSplit, SiStabilisation::kTargetVelocity, SiStabilisation::kNone);
    CAPTURE(static_cast<int>(stabilisation));
    const Real dt = 0.01;
    Island island = resting_ball();
    const int ball = 1;
    const Vec3 start = island.bodies.motion[ball].x;
    SiSettings settings;
    settings.stabilisation = stabilisation;
    for (int k = 0; k < 100; ++k) {
        island.step(dt, settings);
        // One row is solved by one sweep: rounding of 0.3 N s, and of the positions that feed back through 1 / h.
        CHECK(std::abs(island.contacts.total[0].normal - kBallMass * kGravity * dt) < 1e-12);
        CHECK(std::abs(island.contacts.total[0].friction[0]) < 1e-12);
        CHECK(std::abs(island.contacts.total[0].friction[1]) < 1e-12);
        CHECK(island.bodies.velocity[ball].v.norm() < 1e-12);
    }
    CHECK((island.bodies.motion[ball].x - start).norm() < 1e-13);
    CHECK(island.bodies.velocity[kImmovable].v.norm() == 0);
}

TEST_CASE("the first solve may make more sweeps than the second, however many that are") {
    Random random(7);
    Island start = thrown_body(random, 3, 0.5);
    start.bodies.velocity[1] = {Vec3(0.3, -0.2, -3), Vec3(0.5, 1, -0.4)};
    const auto sweeps = [&](int iterations, int first_solve, Real tolerance) {
        Island island = start;
        SiSettings settings = thorough(iterations);
        settings.first_solve = first_solve;
        settings.residual_tolerance = tolerance;
        return island.step(0.01, settings).contact_sweeps;
    };
    CHECK(sweeps(2, 4, 0) == 4 * 2 + 2);
    constexpr int kMost = std::numeric_limits<int>::max();
    CHECK(sweeps(kMost, 4, 1e-4) == sweeps(kMost, 1, 1e-4));  // both end by their residual
}

TEST_CASE("warm impulses solve a resting contact before the first sweep") {
    const SiStabilisation stabilisation = GENERATE(SiStabilisation::kSplit, SiStabilisation::kTargetVelocity);
    CAPTURE(static_cast<int>(stabilisation));
    Island island = resting_ball();
    SiSettings settings = thorough(1);
    settings.stabilisation = stabilisation;
    CHECK(island.step(0.01, settings).residual > 0.01);  // cold: g h / 2 is missing in the last solve
    for (int k = 0; k < 3; ++k) CHECK(island.step(0.01, settings).residual < 1e-12);
}

// Spherical inertia: the angular velocity of a free body stays as it is, so what the push adds can be taken away to rounding.
TEST_CASE("a penetration is pushed out by its share a substep and leaves neither velocity nor impulse behind") {
    Random random(21);
    for (int i = 0; i < 20; ++i) {
        const Real depth = uniform(random, 1e-4, 1e-3), dt = 0.01;
        Island island;
        const RotorInertia rotor = make_rotor_inertia(Vec3::Constant(uniform(random, 0.05, 0.5)), Quat::Identity());
        const int body = island.add_body(make_body(2, rotor, Vec3(0, 0, 0.5), random_rotation(random)), {});
        // A corner of a block, at random below the centre.
        const Vec3 corner(uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5), -depth);
        PointGeometry point;
        point.core_a_A = island.bodies.motion[body].R.transpose() * (corner - island.bodies.motion[body].x);
        island.add_contact(body, kImmovable, Vec3::UnitZ(), NormalFrame::kB, {point}, 0.5);
        const SiSettings settings = thorough(4, 4);
        const Real before = island.contacts.normals[0].separation;
        REQUIRE(std::abs(before + depth) < 1e-15);
        island.step(dt, settings);
        CHECK(island.bodies.velocity[body].v.norm() < 1e-14);  // rounding of a push of 0.1 · 1 mm / 2.5 ms
        CHECK(island.bodies.velocity[body].w.norm() < 1e-14);
        CHECK(island.contacts.total[0].normal < 1e-14);
        // The corner moves on a circle: a turn of φ = 0.4 · 1 mm / 0.5 m lifts it by up to r φ² less or more.
        const Real left = std::pow(1 - settings.contact_push, settings.substeps);
        CHECK(std::abs(island.contacts.normals[0].separation - left * before) < 1e-6);
        CHECK(island.contacts.normals[0].separation > before);
    }
}

TEST_CASE("a contact that opens or is not reached gives no impulse") {
    const int seed = GENERATE(range(0, 20));
    CAPTURE(seed);
    Random random(seed);
    // Faster upwards than anything can bring a point down: 5 m/s against ‖w‖ r = 1.8 · 1.
    Island opening = thrown_body(random, 3, 0.5);
    opening.bodies.velocity[1].v.z() = 5;
    const Vec3 v = opening.bodies.velocity[1].v, w = opening.bodies.velocity[1].w;
    const Vec3 L = inertia_W(opening.bodies.motion[1]) * w;
    opening.step(0.01, thorough(10, 4));
    for (const PointImpulse& total : opening.contacts.total) {
        CHECK(total.normal == 0);
        CHECK(total.friction[0] == 0);
        CHECK(total.friction[1] == 0);
    }
    CHECK((opening.bodies.velocity[1].v - (v - Vec3(0, 0, 0.01 * kGravity))).norm() < 1e-14);
    CHECK((inertia_W(opening.bodies.motion[1]) * opening.bodies.velocity[1].w - L).norm() < 1e-13);

    // A metre away, falling at 1 m/s.
    Island far = thrown_body(random, 3, 0.5);
    set_pose(far.bodies.motion[1], far.bodies.motion[1].x + Vec3::UnitZ(), far.bodies.motion[1].q);
    build_block(far.contacts, far.contacts.blocks[0], far.bodies);
    far.bodies.velocity[1].v.z() = -1;
    far.step(0.01, thorough(10, 4));
    for (const PointImpulse& total : far.contacts.total) CHECK(total.normal == 0);
}

TEST_CASE("normal impulses are never negative and friction stays within the pyramid, however few the sweeps") {
    const int seed = GENERATE(range(0, 50));
    CAPTURE(seed);
    Random random(seed);
    const Real mu = uniform(random, 0.1, 1);
    Island island = thrown_body(random, 1 + seed % 3, mu);
    SiSettings settings;
    settings.iterations = 1 + seed % 5;
    if (seed % 4 == 0) settings.stabilisation = SiStabilisation::kTargetVelocity;
    int held = 0, sliding = 0;
    for (int k = 0; k < 50; ++k) {
        island.step(0.005, settings);
        for (const PointImpulse& total : island.contacts.total) {
            CHECK(total.normal >= 0);
            for (const Real friction : total.friction) {
                // Each substep keeps to its bound to the last bit; sums of four round.
                CHECK(std::abs(friction) <= mu * total.normal * (1 + 8 * kEpsilon));
                sliding += total.normal > 0 && std::abs(friction) > 0.999 * mu * total.normal;
            }
            held += total.normal > 0;
        }
    }
    CAPTURE(sliding);
    if (island.contacts.total.size() == 3) CHECK(held > 0);  // a body on one point may turn away from the plane
}

TEST_CASE("after enough sweeps a point either has no impulse or no normal velocity, and slides only at the bound") {
    const int seed = GENERATE(range(0, 50));
    CAPTURE(seed);
    Random random(seed);
    const Real mu = uniform(random, 0.1, 0.5);
    Island island = thrown_body(random, 3, mu);
    for (int k = 0; k < 10; ++k) {
        island.step(0.01, thorough(500));
        const ContactBlock& block = island.contacts.blocks[0];
        for (int p = 0; p < block.count; ++p) {
            const NormalRow& row = island.contacts.normals[p];
            const PointImpulse& total = island.contacts.total[p];
            const Real velocity = row_velocity(island, block, block.n, row);
            CAPTURE(k, p, velocity, total.normal, row.separation);
            // Sweeps contract by a few per cent at least: 500 of them leave rounding.
            if (row.touching) CHECK(velocity > -1e-9);
            if (total.normal > 0) CHECK(std::abs(velocity) < 1e-9);
            if (!row.touching) CHECK(total.normal == 0);
            for (int j = 0; j < 2; ++j) {
                const FrictionRow& friction = island.contacts.frictions[2 * p + j];
                const Real slip = row_velocity(island, block, friction.t, friction), limit = mu * total.normal;
                CAPTURE(j, slip, total.friction[j], limit);
                if (slip > 1e-9) CHECK(total.friction[j] <= -limit * (1 - 1e-9));
                if (slip < -1e-9) CHECK(total.friction[j] >= limit * (1 - 1e-9));
            }
        }
    }
}

TEST_CASE("a sliding block that cannot turn slows down by the friction coefficient times gravity, then stays") {
    const Real mass = 2, mu = 0.3, dt = 0.01, v0 = 1;
    Island island;
    BodyMotion motion;
    motion.inv_mass = 1 / mass;
    motion.moves = true;
    motion.acceleration = Vec3(0, 0, -kGravity);
    const int block = island.add_body(motion, {Vec3(v0, 0, 0), Vec3::Zero()});
    // The tangent of the first row is the direction of slip: the pyramid's bound is the cone's.
    island.add_contact(block, kImmovable, Vec3::UnitZ(), NormalFrame::kB, {PointGeometry()}, mu);
    REQUIRE(std::abs(island.contacts.frictions[0].t.dot(Vec3::UnitX())) == Approx(1));
    SiSettings settings;
    Real time = 0;
    while (v0 - mu * kGravity * (time + dt) > 0) {
        island.step(dt, settings);
        time += dt;
        CHECK(std::abs(island.bodies.velocity[block].v.x() - (v0 - mu * kGravity * time)) < 1e-12);
        CHECK(std::abs(std::abs(island.contacts.total[0].friction[0]) - mu * mass * kGravity * dt) < 1e-12);
    }
    CHECK(time > 0.3);
    for (int k = 0; k < 3; ++k) island.step(dt, settings);
    CHECK(island.bodies.velocity[block].v.norm() < 1e-12);
    CHECK(std::abs(island.contacts.total[0].friction[0]) < 1e-12);
}

TEST_CASE("a contact between two bodies conserves momentum to rounding, angular momentum too without friction") {
    const int seed = GENERATE(range(0, 50));
    CAPTURE(seed);
    Random random(seed);
    const bool friction = seed % 2 == 0;
    Island island = colliding_pair(random, friction ? 0.5 : 0);
    const Vec3 p = linear_momentum(island.bodies), L = angular_momentum(island.bodies);
    // What a push moves is no momentum, but it moves the bodies that have some: left out.
    SiSettings settings = thorough(4);
    settings.contact_push = 0;
    const SiReport report = island.step(0.005, settings);
    REQUIRE(island.contacts.total[0].normal > 0.01);
    CHECK(report.contact_sweeps <= 8);
    // Impulses on A and B are the same number along opposite directions: a dozen roundings of momenta below 30 N s (4e-15).
    CHECK((linear_momentum(island.bodies) - p).norm() < 1e-13);
    if (friction) {
        CHECK(std::abs(island.contacts.total[0].friction[0]) + std::abs(island.contacts.total[0].friction[1]) > 0);
    } else {
        // The two surface points lie on one line along n, on which the impulses act.
        CHECK((angular_momentum(island.bodies) - L).norm() < 1e-12);
    }
}

TEST_CASE("a ball joint between two bodies conserves momentum to rounding") {
    check_joint_momentum<JointKind::kBall>();
}
TEST_CASE("a hinge between two bodies conserves momentum to rounding") {
    check_joint_momentum<JointKind::kHinge>();
}
TEST_CASE("a slider between two bodies conserves momentum to rounding") {
    check_joint_momentum<JointKind::kSlider>();
}
TEST_CASE("a fixed joint between two bodies conserves momentum to rounding") {
    check_joint_momentum<JointKind::kFixed>();
}
TEST_CASE("a rod between two bodies conserves momentum to rounding, angular momentum too") {
    check_joint_momentum<JointKind::kDistance>();
    Random random(99);
    Island island = jointed_pair<JointKind::kDistance>(random);
    const Vec3 L = angular_momentum(island.bodies);
    for (int k = 0; k < 20; ++k) island.step(0.005, thorough(1, 2));
    // Its impulses act on one line, from anchor to anchor: 40 substeps of two dozen roundings.
    CHECK((angular_momentum(island.bodies) - L).norm() < 1e-12);
}

TEST_CASE("what hangs from the world by a ball joint pulls on it with its weight") {
    const Real mass = 2, dt = 0.01;
    Random random(5);
    Island island;
    BodyMotion motion =
        make_body(mass, make_rotor_inertia(random_moments(random, mass), random_rotation(random)), Vec3(0, 0, -1), random_rotation(random));
    motion.acceleration = Vec3(0, 0, -kGravity);
    const int body = island.add_body(motion, {});
    JointGeometry geometry;
    geometry.anchor_a_A = motion.R.transpose() * Vec3(0, 0, 1);
    add_joint<JointKind::kBall>(island, body, kImmovable, geometry);
    for (int k = 0; k < 10; ++k) {
        island.joints.ball[0].total.setZero();
        island.step(dt, SiSettings{});
        CHECK((island.joints.ball[0].total - Vec3(0, 0, mass * kGravity * dt)).norm() < 1e-12);
    }
    CHECK((island.bodies.motion[body].x - Vec3(0, 0, -1)).norm() < 1e-13);
    CHECK(island.bodies.velocity[kImmovable].v.norm() + island.bodies.velocity[kImmovable].w.norm() == 0);
}
