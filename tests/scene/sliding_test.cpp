// Coulomb friction: a block that slides to a stop, and a block on a slope.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <algorithm>

using namespace cairn;
using namespace world_building;

namespace {

// How far a block launched at `speed` in the direction `heading` slides, turned by `yaw` about the vertical.
Real stop_distance(const BodyDef& floor, Real mu, Real speed, Real heading, Real yaw, Real* sideways) {
    World world;
    world.add_body(floor);
    BodyDef def = body(Shape::box({0.4, 0.25, 0.15}), {0, 0, 0.15}, 3, mu);
    const Vec3 along(std::cos(heading), std::sin(heading), 0);
    def.rotation = turn(Vec3::UnitZ(), yaw);
    def.linear_velocity = speed * along;
    const BodyId id = world.add_body(def);
    run(world, speed / (mu * kG) + 0.5);
    const Vec3 p = world.state(id).position;
    *sideways = std::abs(along.x() * p.y() - along.y() * p.x());
    CHECK(world.state(id).linear_velocity.norm() < 1e-3);
    return p.dot(along);
}

// Where a block on a slope is after t [s], along the slope's fall. The slope is a plane; gravity is vertical.
Real slide_down(Real angle, Real mu, Real yaw, Real t) {
    World world;
    const Vec3 n(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
    world.add_body(fixed(Shape::plane(n, 0), Vec3::Zero(), mu));
    BodyDef def = body(Shape::box({0.3, 0.2, 0.1}), 0.1 * n, 2, mu);
    def.rotation = turn(Vec3::UnitY(), angle) * turn(Vec3::UnitZ(), yaw);
    const BodyId id = world.add_body(def);
    run(world, t);
    return (world.state(id).position - 0.1 * n).dot(down);
}

}  // namespace

TEST_CASE("a block launched along the ground stops after v² / (2 μ g), whatever the heading and however it is turned") {
    const Real mu = 0.45, speed = 4, truth = speed * speed / (2 * mu * kG);
    Real shortest = truth, longest = truth;
    for (int h = 0; h < 24; ++h) {
        for (int y = 0; y < 4; ++y) {
            const Real heading = 2 * kPi * h / 24, yaw = kPi / 2 * y / 4;
            CAPTURE(h, y);
            Real sideways = 0;
            const Real way = stop_distance(ground(mu), mu, speed, heading, yaw, &sideways);
            CHECK(std::abs(way - truth) < 0.01);
            CHECK(sideways < 0.01);
            shortest = std::min(shortest, way), longest = std::max(longest, way);
        }
    }
    CHECK((longest - shortest) / truth < 0.002);
}

TEST_CASE("a block on a slope a tenth beyond its friction angle goes g (sinθ − μ cosθ) t² / 2, at every yaw") {
    const Real mu = 0.5, angle = 1.1 * std::atan(mu), t = 1.5;
    const Real truth = kG * (std::sin(angle) - mu * std::cos(angle)) * t * t / 2;
    for (int k = 0; k < 24; ++k) {
        CAPTURE(k);
        CHECK(std::abs(slide_down(angle, mu, 2 * kPi * k / 24, t) / truth - 1) < 0.01);
    }
}

TEST_CASE("a block on a slope with a fiftieth of friction to spare stays, at every yaw") {
    const Real mu = 0.5, angle = std::atan(mu / 1.02);
    for (int k = 0; k < 24; ++k) {
        CAPTURE(k);
        CHECK(std::abs(slide_down(angle, mu, 2 * kPi * k / 24, 3)) < 1e-3);
    }
}

TEST_CASE("a block slides over a flat mesh as over a plane, and a ball never hops on one") {
    std::vector<Vec3> vertices;
    std::vector<std::array<int, 3>> triangles;
    const int n = 24;
    for (int x = 0; x <= n; ++x)
        for (int y = 0; y <= n; ++y) vertices.emplace_back(0.35 * x - 2, 0.35 * y - 4.2, 0);
    for (int x = 0; x < n; ++x)
        for (int y = 0; y < n; ++y) {
            const int i = (n + 1) * x + y;
            triangles.push_back({i, i + n + 1, i + n + 2});
            triangles.push_back({i, i + n + 2, i + 1});
        }
    const BodyDef mesh = fixed(Shape::triangle_mesh(vertices, triangles), Vec3::Zero(), 0.45);
    const Real heading = GENERATE(0.0, 0.3, -0.6);
    CAPTURE(heading);
    Real sideways = 0;
    const Real way = stop_distance(mesh, 0.45, 4, heading, 0.2, &sideways);
    CHECK(std::abs(way - 16 / (2 * 0.45 * kG)) < 0.01);
    CHECK(sideways < 0.01);

    World world;
    world.add_body(mesh);
    BodyDef def = ball(0.25, {-1, 0, 0.25}, 1, 0.45);
    const Vec3 along(std::cos(heading), std::sin(heading), 0);
    def.linear_velocity = 2 * along;
    def.angular_velocity = 8 * Vec3::UnitZ().cross(along);
    const BodyId id = world.add_body(def);
    for (int k = 0; k < 150; ++k) {
        world.step(kStep);
        const BodyState s = world.state(id);
        // An inner edge that is felt would throw it up by some tenths of its radius.
        REQUIRE(std::abs(s.position.z() - 0.25) < 1e-4);
        REQUIRE((s.linear_velocity - 2 * along).norm() < 1e-3);
    }
}

TEST_CASE("a box on a slowly turning disc stays where it is on the disc") {
    World world;
    const Real rate = 0.5, r = 1.5;
    BodyDef disc;
    disc.name = "disc";
    disc.type = BodyType::kKinematic;
    disc.shapes = {Shape::cylinder(3, 0.1)};
    disc.position = {0, 0, -0.1};
    disc.angular_velocity = {0, 0, rate};
    disc.friction = 0.6;
    world.add_body(disc);
    BodyDef def = cube(0.4, {r, 0, 0.2}, 1, 0.6);  // ω² r = 0.375 m/s² against μ g = 5.9
    def.linear_velocity = {0, rate * r, 0};
    def.angular_velocity = {0, 0, rate};
    const BodyId id = world.add_body(def);
    run(world, 3);
    const Vec3 on_disc = turn(Vec3::UnitZ(), -rate * 3) * world.state(id).position;
    // A friction row forgets how far it slipped within its tolerance: 180 steps of that.
    CHECK((on_disc - Vec3(r, 0, 0.2)).norm() < 0.01);
    const Quat q = turn(Vec3::UnitZ(), -rate * 3) * world.state(id).rotation;
    CHECK(q.vec().norm() < 0.005);
}
