// Rolling, bouncing, impact.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

TEST_CASE("a ball launched sliding ends rolling at 5/7 of its speed") {
    const Real dt = GENERATE(1.0 / 240, 1.0 / 60);
    const Real heading = GENERATE(0.0, 0.4, 2.0);
    CAPTURE(dt, heading);
    World world;
    world.add_body(ground(0.3));
    BodyDef def = ball(0.3, {0, 0, 0.3}, 2, 0.3);
    const Vec3 along(std::cos(heading), std::sin(heading), 0);
    def.linear_velocity = 5 * along;
    const BodyId id = world.add_body(def);
    run(world, 1.5, dt);  // rolls after 2 v / (7 μ g) = 0.49 s
    const BodyState s = world.state(id);
    // The friction has no moment about the line of contact, whatever its size: m v r − I ω stays.
    CHECK((s.linear_velocity - 5.0 / 7 * 5 * along).norm() < 1e-6);
    CHECK((s.angular_velocity - 5.0 / 7 * 5 / 0.3 * Vec3::UnitZ().cross(along)).norm() < 1e-5);
}

TEST_CASE("a round body rolls down an incline with g sinθ / (1 + I / m r²)") {
    struct Case {
        const char* name;
        Shape shape;
        Real inertia;  // I / m r²
    };
    const Real r = 0.2, h = 0.3;
    // Capsule: cylinder of 2h and two half balls, by volume.
    const Real cylinder = 2 * h, caps = 4.0 / 3 * r;
    const Real capsule = (cylinder * 0.5 + caps * 0.4) / (cylinder + caps);
    const Pose lying{turn(Vec3::UnitX(), kPi / 2), Vec3::Zero()};  // axis along y
    const int which = GENERATE(0, 1, 2);
    const Case c = which == 0   ? Case{"sphere", Shape::sphere(r), 0.4}
                   : which == 1 ? Case{"cylinder", Shape::cylinder(r, h, lying), 0.5}
                                : Case{"capsule", Shape::capsule(r, h, lying), capsule};
    CAPTURE(c.name);
    const Real angle = 0.3;
    World world;
    const Vec3 n(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
    world.add_body(fixed(Shape::plane(n, 0), Vec3::Zero(), 0.6));
    const BodyId id = world.add_body(body(c.shape, r * n, 1.5, 0.6));
    const Real t = 2;
    run(world, t);
    const Real truth = kG * std::sin(angle) / (1 + c.inertia) * t * t / 2;
    const Vec3 way = world.state(id).position - r * n;
    CHECK(std::abs(way.dot(down) / truth - 1) < 1e-3);
    CHECK(std::abs(way.y()) < 1e-3 * truth);
    CHECK(std::abs(way.dot(n)) < 1e-4);
}

TEST_CASE("the apex of a bouncing ball falls by e² a bounce, wherever in a step the impact falls") {
    const Real e = GENERATE(0.5, 0.8, 1.0);
    for (int k = 0; k < 12; ++k) {
        const Real height = 1 + 0.013 * k;  // of the lowest point: other fractions of a step each
        CAPTURE(e, height);
        World world;
        world.add_body(ground(0, e));
        BodyDef def = ball(0.2, {0, 0, 0.2 + height}, 1, 0);
        def.restitution = e;
        const BodyId id = world.add_body(def);
        // Apex from the state: z + v² / 2g, constant in flight.
        Real before = height;
        for (int bounce = 0; bounce < 3; ++bounce) {
            bool up = false;
            for (int step = 0; step < 200 && !up; ++step) {
                const bool falling = world.state(id).linear_velocity.z() < 0;
                world.step(kStep);
                up = falling && world.state(id).linear_velocity.z() > 0;
            }
            REQUIRE(up);
            const BodyState s = world.state(id);
            const Real apex = s.position.z() - 0.2 + s.linear_velocity.z() * s.linear_velocity.z() / (2 * kG);
            CHECK(std::abs(apex / before - e * e) < 1e-9);
            before = apex;
        }
    }
}

TEST_CASE("two equal balls that meet head-on swap their velocities when the impact is elastic") {
    const Real gap = GENERATE(0.5, 0.51, 0.533, 0.57);
    CAPTURE(gap);
    World world(no_gravity());
    BodyDef a = ball(0.2, {0, 0, 0}), b = ball(0.2, {0.4 + gap, 0, 0});
    a.restitution = b.restitution = 1;
    a.linear_velocity = {3, 0, 0}, b.linear_velocity = {-1, 0, 0};
    const BodyId i = world.add_body(a), k = world.add_body(b);
    run(world, 0.5);
    CHECK((world.state(i).linear_velocity - Vec3(-1, 0, 0)).norm() < 1e-9);
    CHECK((world.state(k).linear_velocity - Vec3(3, 0, 0)).norm() < 1e-9);
    // They met at gap / 4 s; from there on each has the other's velocity.
    CHECK(std::abs(world.state(i).position.x() - (3 * gap / 4 - (0.5 - gap / 4))) < 1e-9);
}

TEST_CASE("in a plastic impact two balls go on with their common momentum") {
    World world(no_gravity());
    BodyDef a = ball(0.2, {0, 0, 0}, 2), b = ball(0.2, {0.9, 0, 0}, 1);
    a.linear_velocity = {3, 0, 0}, b.linear_velocity = {0, 0, 0};
    const BodyId i = world.add_body(a), k = world.add_body(b);
    run(world, 0.5);
    CHECK((world.state(i).linear_velocity - Vec3(2, 0, 0)).norm() < 1e-9);
    CHECK((world.state(k).linear_velocity - Vec3(2, 0, 0)).norm() < 1e-9);
}

TEST_CASE("a fast body does not pass a thin wall") {
    const Real speed = GENERATE(30.0, 100.0, 300.0);
    const int shape = GENERATE(0, 1, 2);
    CAPTURE(speed, shape);
    World world(no_gravity());
    world.add_body(fixed(Shape::box({0.01, 2, 2})));
    for (Real x : {-3.0, -3.7, -4.1, -5.3}) {
        BodyDef def = body(shape == 0   ? Shape::sphere(0.1)
                           : shape == 1 ? Shape::box({0.1, 0.1, 0.1})
                                        : Shape::capsule(0.05, 0.1),
                           {x, 0.5 * x + 2, 0});
        def.linear_velocity = {speed, 0, 0};
        def.rotation = turn({1, 2, 3}, 0.5);
        world.add_body(def);
    }
    run(world, 0.5);
    for (BodyId id : world.bodies())
        if (world.type(id) == BodyType::kDynamic) CHECK(world.state(id).position.x() < 0);
}
