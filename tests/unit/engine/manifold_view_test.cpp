// What World::manifolds says of contacts.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

constexpr Real kRounding = 1e-12;

// n, t1, t2 orthonormal and right-handed; positions `separation` apart along n; anchors where the bodies have the positions.
void check_geometry(const World& world, const ManifoldView& m, Real tolerance) {
    for (int k = 0; k < m.count; ++k) {
        const ContactPointView& p = m.points[k];
        CHECK(std::abs(m.n.norm() - 1) < kRounding);
        CHECK(std::abs(p.t1.norm() - 1) < kRounding);
        CHECK(std::abs(p.t1.dot(m.n)) < kRounding);
        CHECK((p.t2 - m.n.cross(p.t1)).norm() < kRounding);
        const BodyState a = world.state(m.body_a), b = world.state(m.body_b);
        CHECK((a.position + a.rotation * p.anchor_a - p.position_a).norm() < kRounding);
        CHECK((b.position + b.rotation * p.anchor_b - p.position_b).norm() < kRounding);
        CHECK(std::abs(m.n.dot(p.position_a - p.position_b) - p.separation) < tolerance);
    }
}

}  // namespace

TEST_CASE("a box at rest on a plane has four points that carry its weight") {
    const bool box_first = GENERATE(true, false);
    World world;
    const Real mass = 3;
    BodyId box;
    if (box_first) box = world.add_body(body(Shape::box({0.5, 0.4, 0.3}), {0, 0, 0.3}, mass));
    world.add_body(ground());
    if (!box_first) box = world.add_body(body(Shape::box({0.5, 0.4, 0.3}), {0, 0, 0.3}, mass));
    run(world, 2);
    const std::vector<ManifoldView> manifolds = world.manifolds();
    REQUIRE(manifolds.size() == 1);
    const ManifoldView& m = manifolds[0];
    REQUIRE(m.count == 4);
    CHECK(m.friction == 0.5);
    CHECK(m.restitution == 0);
    CHECK(m.shape_a == 0);
    CHECK(m.shape_b == 0);
    // n points from B to A.
    CHECK((m.n - (m.body_a == box ? 1 : -1) * Vec3::UnitZ()).norm() < 1e-9);
    check_geometry(world, m, 1e-9);  // the body rests: poses of the step's start and end are the same to that
    Real sum = 0;
    Vec3 lever = Vec3::Zero();
    for (int k = 0; k < 4; ++k) {
        const Vec3 corner = m.body_a == box ? m.points[k].anchor_a : m.points[k].anchor_b;
        CHECK((corner.cwiseAbs() - Vec3(0.5, 0.4, 0.3)).norm() < 1e-6);
        CHECK(m.points[k].normal_impulse > 0);
        sum += m.points[k].normal_impulse;
        lever += m.points[k].normal_impulse * Vec3(corner.x(), corner.y(), 0);
        for (int j = k + 1; j < 4; ++j) CHECK(m.points[k].feature != m.points[j].feature);
    }
    // At rest the impulses balance the weight and its moment: what is left is what the velocities may still change, tolerance / (g dt).
    CHECK(std::abs(sum / kStep / (mass * kG) - 1) < 1e-6);
    CHECK(lever.norm() / sum < 1e-6);
}

TEST_CASE("friction holds a box on a slope with m g sinθ against the slope's fall") {
    const Real angle = GENERATE(0.1, 0.3);
    World world;
    const Vec3 n(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
    world.add_body(fixed(Shape::plane(n, 0), Vec3::Zero(), 0.8));
    BodyDef def = cube(1, 0.5 * n, 2, 0.8);
    def.rotation = turn(Vec3::UnitY(), angle);
    const BodyId box = world.add_body(def);
    run(world, 2);
    Vec3 on_box = Vec3::Zero();
    for (const ManifoldView& m : world.manifolds()) {
        check_geometry(world, m, 1e-6);
        for (int k = 0; k < m.count; ++k) {
            const ContactPointView& p = m.points[k];
            on_box +=
                (m.body_a == box ? 1 : -1) * (p.normal_impulse * m.n + p.friction_impulse[0] * p.t1 + p.friction_impulse[1] * p.t2) / kStep;
        }
    }
    const Real weight = 2 * kG;
    CHECK(std::abs(on_box.dot(n) / (weight * std::cos(angle)) - 1) < 1e-4);
    CHECK(std::abs(-on_box.dot(down) / (weight * std::sin(angle)) - 1) < 1e-4);
    CHECK(std::abs(on_box.y()) < 1e-4 * weight);
}

TEST_CASE("the friction of a sliding box is μ λ_N along t1, against the slip") {
    World world;
    world.add_body(ground(0.4));
    BodyDef def = cube(1, {0, 0, 0.5}, 2, 0.4);
    def.linear_velocity = {6, 2, 0};
    const BodyId box = world.add_body(def);
    run(world, 0.3);
    const BodyState before = world.state(box);
    world.step(kStep);
    for (const ManifoldView& m : world.manifolds()) {
        const Real side = m.body_a == box ? 1 : -1;
        for (int k = 0; k < m.count; ++k) {
            const ContactPointView& p = m.points[k];
            // The slip of this corner when the step began.
            const Vec3 arm = before.rotation * (m.body_a == box ? p.anchor_a : p.anchor_b);
            Vec3 slip = before.linear_velocity + before.angular_velocity.cross(arm);
            slip -= m.n * m.n.dot(slip);
            CHECK((p.t1 - side * slip.normalized()).norm() < 1e-6);
            CHECK(std::abs(p.friction_impulse[0] + 0.4 * p.normal_impulse) <= 1e-9 * p.normal_impulse);
        }
    }
}
