#include "solver/bounce.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

using namespace cairn;
using namespace cairn::solver_test;

namespace {

constexpr Real kGravity = 9.81;

// A ball that does not turn, its lowest point `gap` above the plane z = 0 and moving at `v` along z.
Island ball_over_plane(Real gap, Real v, Real restitution, Real gravity = kGravity) {
    const Real radius = 0.25;
    Island island;
    BodyMotion motion =
        make_body(2, make_rotor_inertia(Vec3::Constant(0.05), Quat::Identity()), Vec3(0, 0, radius + gap), Quat::Identity());
    motion.acceleration = Vec3(0, 0, -gravity);
    const int ball = island.add_body(motion, {Vec3(0, 0, v), Vec3::Zero()});
    PointGeometry point;
    point.radius_a = radius;
    island.add_contact(ball, kImmovable, Vec3::UnitZ(), NormalFrame::kWorld, {point}, 0, restitution);
    return island;
}

const NormalRow& predicted(Island& island, Real h) {
    predict_bounces(island.contacts, island.range.contacts, island.bodies, h, true);
    return island.contacts.normals[0];
}

}  // namespace

TEST_CASE("a bounce within a substep is predicted where two parabolas lead") {
    Random random(1);
    int bounces = 0;
    for (int i = 0; i < 1000; ++i) {
        const Real h = 0.01, gap = uniform(random, 0, 0.02), v = uniform(random, -4, 4), e = uniform(random, 0.05, 1);
        Island island = ball_over_plane(gap, v, e);
        // The separation is z − r, which rounds: the closed form starts from what the row says.
        const Real s = island.contacts.normals[0].separation;
        const NormalRow& row = predicted(island, h);
        // Down: s + v τ − g τ²/2 = 0 at the speed √(v² + 2 g s); up: e times that.
        const Real speed = std::sqrt(v * v + 2 * kGravity * s), tau = (v + speed) / kGravity, rest = h - tau;
        const Real lift = e * speed * rest - 0.5 * kGravity * rest * rest;
        CAPTURE(s, v, e, tau);
        if (rest <= 0 || lift <= 0) {
            CHECK(row.lift == 0);
            CHECK(row.bounce == 0);
            continue;
        }
        ++bounces;
        // τ cancels here: an error of 4 · 2e-16 / g, which lift sees times the speed.
        CHECK(std::abs(row.lift - lift) < 1e-14);
        CHECK(std::abs(row.bounce - (e * speed - kGravity * rest)) < 4e-14);
    }
    CHECK(bounces > 100);
}

TEST_CASE("no bounce is predicted for what separates, rests, arrives later, or would be back on the ground within the substep") {
    const Real h = 0.01;
    const auto lift = [h](Real gap, Real v, Real e) {
        Island island = ball_over_plane(gap, v, e);
        return predicted(island, h).lift;
    };
    CHECK(lift(0, 0, 1) == 0);         // rests
    CHECK(lift(0, 1, 1) == 0);         // separates
    CHECK(lift(0.001, 1, 1) == 0);     // separates, and comes back after the substep
    CHECK(lift(0.1, -1, 1) == 0);      // arrives later
    CHECK(lift(0, -1, 0) == 0);        // does not bounce
    CHECK(lift(0, -0.09, 0.5) == 0);   // flies for 2 e v / g = 0.0092 s
    CHECK(lift(0, -0.11, 0.5) > 0);    // flies for 0.0112 s
    CHECK(lift(0.005, -1, 0.5) > 0);   // arrives at 0.005 s
    CHECK(lift(-0.001, -1, 0.5) > 0);  // has arrived
}

TEST_CASE("a bounce that is no longer there leaves nothing behind") {
    Island island = ball_over_plane(0, -1, 0.5);
    REQUIRE(predicted(island, 0.01).lift > 0);
    island.bodies.velocity[1].v.z() = 1;
    CHECK(predicted(island, 0.01).lift == 0);
    CHECK(island.contacts.normals[0].bounce == 0);
}

TEST_CASE("two bodies that fall together bounce off each other as without gravity") {
    Random random(2);
    for (int i = 0; i < 100; ++i) {
        const Real gap = uniform(random, 0, 0.005), v = uniform(random, -2, -1), e = uniform(random, 0.3, 1), h = 0.01;
        Island island;
        for (int k = 0; k < 2; ++k) {
            BodyMotion motion =
                make_body(1 + k, make_rotor_inertia(Vec3::Constant(0.1), Quat::Identity()), Vec3(0, 0, k * (0.5 + gap)), Quat::Identity());
            motion.acceleration = Vec3(0, 0, -kGravity);
            island.add_body(motion, {Vec3(0, 0, k * v), Vec3::Zero()});
        }
        PointGeometry point;
        point.radius_a = point.radius_b = 0.25;
        island.add_contact(2, 1, Vec3::UnitZ(), NormalFrame::kWorld, {point}, 0, e);
        const NormalRow& row = predicted(island, h);
        CHECK(std::abs(row.bounce + e * v) < 1e-14);
        CHECK(std::abs(row.lift + e * v * (h - gap / -v)) < 1e-14);
    }
}

TEST_CASE("after a step with a bounce in it a ball is where the two parabolas lead") {
    Random random(3);
    int bounces = 0;
    for (int i = 0; i < 300; ++i) {
        const Real dt = 0.01, gap = uniform(random, 0, 0.01), v = uniform(random, -3, -1), e = uniform(random, 0.1, 1);
        Island island = ball_over_plane(gap, v, e);
        const Real s = island.contacts.normals[0].separation;
        const Real speed = std::sqrt(v * v + 2 * kGravity * s), tau = (v + speed) / kGravity, rest = dt - tau;
        // Nearer to the end of the step than this, the bounce may be left to the next one.
        if (rest < 1e-3) continue;
        ++bounces;
        SiSettings settings;
        settings.substeps = 1 + i % 4;
        const Real z = island.bodies.motion[1].x.z();
        island.step(dt, settings);
        CAPTURE(s, v, e, tau, settings.substeps);
        // Roundings of 3 m/s and 0.3 m, and 1e-15 of τ times the speed.
        CHECK(std::abs(island.bodies.velocity[1].v.z() - (e * speed - kGravity * rest)) < 4e-14);
        CHECK(std::abs(island.bodies.motion[1].x.z() - (z - s + e * speed * rest - 0.5 * kGravity * rest * rest)) < 1e-14);
        // The impulse is what turned −speed into e speed.
        CHECK(std::abs(island.contacts.total[0].normal - 2 * (1 + e) * speed) < 4e-14);
    }
    CHECK(bounces > 100);
}
