// What shorter steps must bring.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

// A tall box that turns about a bottom edge, nearly to where it would topple; its height after `duration`.
Real height_of_tipping_box(Real dt, Real duration) {
    const Vec3 half(0.4, 0.6, 0.8);
    World world;
    world.add_body(ground(2));
    BodyDef box = body(Shape::box(half), {0, 0, half.z()}, 5, 2);
    const Vec3 w(0, 1.2, 0), from_edge(-half.x(), 0, half.z());  // the edge at +x stays
    box.angular_velocity = w;
    box.linear_velocity = w.cross(from_edge);
    const BodyId id = world.add_body(box);
    run(world, duration, dt);
    return world.state(id).position.z();
}

}  // namespace

TEST_CASE("a box that tips about its edge is followed the better, the shorter the step") {
    // The error of second order falls to a sixteenth over two halvings. Rows that lag behind by an angle that does not fall with the step
    // would leave 1e-3 of the motion whatever the step.
    constexpr Real kDuration = 0.5;  // [s]
    const Real finest = height_of_tipping_box(1.0 / 1920, kDuration);
    const Real coarse = std::abs(height_of_tipping_box(1.0 / 60, kDuration) - finest);
    const Real middle = std::abs(height_of_tipping_box(1.0 / 240, kDuration) - finest);
    const Real fine = std::abs(height_of_tipping_box(1.0 / 480, kDuration) - finest);
    CHECK(coarse < 1e-3);
    CHECK(middle < coarse / 8);
    CHECK(fine < middle / 2);
}

TEST_CASE("a stack stands at any step") {
    // What a solve leaves of its balance grows in a stack, which is a pendulum upside down: it has to stand before that shows.
    const int steps_per_second = GENERATE(30, 120, 480, 1920);
    constexpr int kCount = 20;
    World world;
    world.add_body(ground(0.6));
    std::vector<BodyId> boxes;
    for (int i = 0; i < kCount; ++i) boxes.push_back(world.add_body(cube(1, {0, 0, 0.5 + i}, 1, 0.6)));
    run(world, 2, 1.0 / steps_per_second);
    for (int i = 0; i < kCount; ++i) CHECK((world.state(boxes[i]).position - Vec3(0, 0, 0.5 + i)).norm() < 1e-7);
}
