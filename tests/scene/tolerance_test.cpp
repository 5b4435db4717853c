// Steps to a tolerance (engine/error_control.hpp): the error that is asked for is met, with what that takes and no more.
#include "engine/base/error.hpp"
#include "engine/world.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <limits>

using namespace cairn;
using namespace world_building;

namespace {

struct Outcome {
    std::vector<Vec3> path;  // of the last body, after each step
    Real estimated = 0;      // [m], the steps' largest estimates summed
    int estimates = 0;
    int steps = 0;
    std::uint64_t rotor_calls = 0;
    std::uint64_t hash = 0;
};

using Build = void (*)(World&);

Outcome run(Build build, Real duration, Real dt, Real tolerance) {
    WorldSettings settings;
    settings.tolerance = tolerance;
    World world(settings);
    build(world);
    Outcome o;
    o.steps = static_cast<int>(std::lround(duration / dt));
    for (int k = 0; k < o.steps; ++k) {
        const StepReport report = world.step(dt);
        o.estimated += report.error_rate * dt;
        o.estimates += static_cast<int>(report.error_estimates);
        o.rotor_calls += report.rotor_calls;
        o.path.push_back(world.state(world.bodies().back()).position);
    }
    o.hash = world.hash();
    return o;
}

BodyId hang(World& world, JointType type, const Vec3& from, const Vec3& to, BodyId above = {}) {
    const Vec3 along = to - from;
    BodyDef rod = body(Shape::box({0.5 * along.norm(), 0.05, 0.08}), 0.5 * (from + to));
    const BodyId id = world.add_body(rod);
    world.add_joint({type, id, above, from, from, Vec3::UnitY()});
    return id;
}

void pendulum(World& world) {
    hang(world, JointType::kBall, {0, 0, 0}, {1, 0, 0});
}

void double_pendulum(World& world) {
    hang(world, JointType::kHinge, {1, 0, 0}, {2, 0, 0}, hang(world, JointType::kHinge, {0, 0, 0}, {1, 0, 0}));
}

void rod_pendulum(World& world) {
    const BodyId id = world.add_body(ball(0.2, {1, 0, 0}));
    world.add_joint({JointType::kDistance, id, BodyId{}, {1, 0, 0}, {0, 0, 0}, Vec3::UnitY()});
}

void spinning_top(World& world) {
    BodyDef def = body(Shape::cylinder(0.2, 0.05), {0.2, 0, 0.2});
    def.rotation = turn({0, 1, 0}, kPi / 4);
    def.angular_velocity = 40 * Vec3(1, 0, 1).normalized();
    world.add_joint({JointType::kBall, world.add_body(def), BodyId{}, {0, 0, 0}, {0, 0, 0}, Vec3::UnitY()});
}

void thrown_box(World& world) {
    BodyDef def = body(Shape::box({0.3, 0.2, 0.1}), {0, 0, 5});
    def.linear_velocity = {3, 0, 5};
    def.angular_velocity = {3, 4, 5};
    world.add_body(def);
}

constexpr Real kFriction = 0.4, kSpeed = 5;

void sliding_box(World& world) {
    world.add_body(ground(kFriction));
    BodyDef def = cube(0.4, {0, 0, 0.2}, 1, kFriction);
    def.shapes = {Shape::box({0.4, 0.4, 0.1})};
    def.position.z() = 0.1;
    def.linear_velocity = {kSpeed, 0, 0};
    world.add_body(def);
}

constexpr Real kBounce = 0.7, kDrop = 2;

void bouncing_ball(World& world) {
    world.add_body(ground(0.5, kBounce));
    BodyDef def = ball(0.3, {0, 0, 0.3 + kDrop});
    def.restitution = kBounce;
    world.add_body(def);
}

void resting_boxes(World& world) {
    world.add_body(ground());
    for (int k = 0; k < 3; ++k) world.add_body(cube(0.5, {0, 0, 0.25 + 0.5 * k}));
}

Real worst(const std::vector<Vec3>& path, const std::vector<Vec3>& truth) {
    const std::size_t ratio = truth.size() / path.size();
    Real error = 0;
    for (std::size_t k = 0; k < path.size(); ++k) error = std::max(error, (path[k] - truth[ratio * (k + 1) - 1]).norm());
    return error;
}

}  // namespace

TEST_CASE("joints end within three times the error that is admitted") {
    const auto [name, build] = GENERATE(table<const char*, Build>({{"pendulum", pendulum}, {"rod", rod_pendulum}, {"top", spinning_top}}));
    constexpr Real kDuration = 2;
    // 4th order: 16 steps instead of one leave 1.5e-5 of the default's error, which is under 1e-3 m.
    const Outcome truth = run(build, kDuration, kStep / 16, 0);
    for (const Real tolerance : {1e-3, 1e-4, 1e-5, 1e-6}) {
        const Outcome o = run(build, kDuration, kStep, tolerance);
        CAPTURE(name, tolerance, o.estimated);
        CHECK(worst(o.path, truth.path) <= 3 * tolerance * kDuration);
        CHECK(o.estimated <= tolerance * kDuration);
        CHECK(o.estimated > 0);
    }
}

TEST_CASE("a sliding box stops, and a ball bounces, where closed forms say, within the error that is admitted") {
    const Real tolerance = GENERATE(1e-3, 1e-4, 1e-5, 1e-6), duration = 1.5;
    CAPTURE(tolerance);
    const Outcome slide = run(sliding_box, duration, kStep, tolerance);
    CHECK(std::abs(slide.path.back().x() - kSpeed * kSpeed / (2 * kFriction * kG)) <= 3 * tolerance * duration);

    const Outcome bounce = run(bouncing_ball, duration, kStep, tolerance);
    const Real fall = std::sqrt(2 * kDrop / kG), v = kBounce * kG * fall;
    for (std::size_t k = 0; k < bounce.path.size(); ++k) {
        const Real t = static_cast<Real>(k + 1) * kStep;
        if (t > fall + 2 * v / kG) break;
        const Real truth = t < fall ? kDrop - kG * t * t / 2 : v * (t - fall) - kG * (t - fall) * (t - fall) / 2;
        REQUIRE(std::abs(bounce.path[k].z() - 0.3 - truth) <= 3 * tolerance * duration);
    }
}

TEST_CASE("the error of a double pendulum, and its estimate, fall with the tolerance") {
    constexpr Real kDuration = 1.5;
    const Outcome truth = run(double_pendulum, kDuration, kStep / 16, 0);
    Real last_estimate = std::numeric_limits<Real>::infinity(), first_error = 0, error = 0;
    for (const Real tolerance : {1e-3, 1e-4, 1e-5, 1e-6}) {
        const Outcome o = run(double_pendulum, kDuration, kStep, tolerance);
        error = worst(o.path, truth.path);
        if (first_error == 0) first_error = error;
        CAPTURE(tolerance, error, o.estimated);
        CHECK(error <= 3 * tolerance * kDuration);
        CHECK(o.estimated <= tolerance * kDuration);
        CHECK(o.estimated < last_estimate);
        last_estimate = o.estimated;
    }
    // In proportion would be 1e-3; the levels are a factor 16 apart.
    CHECK(error < 1e-3 * 16 * first_error);
}

TEST_CASE("a free box turns as exactly as is asked, and for less where less is asked") {
    constexpr Real kDuration = 2;
    std::uint64_t last = 0;
    for (const Real tolerance : {1e-3, 1e-5, 1e-7}) {
        const Outcome o = run(thrown_box, kDuration, kStep, tolerance);
        CAPTURE(tolerance, o.rotor_calls, o.estimated);
        CHECK(o.estimated <= tolerance * kDuration);
        // One call a step, and few estimates.
        CHECK(o.rotor_calls <= static_cast<std::uint64_t>(1.3 * o.steps));
        CHECK(o.rotor_calls >= last);
        last = o.rotor_calls;
    }
}

TEST_CASE("what rests is hardly ever measured") {
    const Outcome o = run(resting_boxes, 10, kStep, 1e-5);
    // At 1, 2, 4 … 32 steps' distance at most: 600 / 32, and a dozen while the boxes settle.
    CHECK(o.estimates < 40);
    CHECK(o.estimates > 0);
    CHECK((o.path.back() - Vec3(0, 0, 1.25)).norm() < 1e-5 * 10);
}

TEST_CASE("without a tolerance nothing is measured, and a bad one is refused") {
    CHECK(run(pendulum, 0.5, kStep, 0).estimates == 0);
    CHECK(run(pendulum, 0.5, kStep, 0).estimated == 0);
    for (const Real bad : {-1e-3, std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity()}) {
        WorldSettings settings;
        settings.tolerance = bad;
        CHECK_THROWS_AS(World(settings), Error);
    }
}

TEST_CASE("a caller's hand is noticed: a pendulum that is struck is measured at once") {
    WorldSettings settings;
    settings.tolerance = 1e-5;
    World world(settings);
    hang(world, JointType::kBall, {0, 0, 0}, {0, 0, -1});
    for (int k = 0; k < 600; ++k) world.step(kStep);
    world.apply_impulse(world.bodies().back(), {5, 0, 0}, {0, 0, -1});
    CHECK(world.step(kStep).error_estimates > 0);
}

TEST_CASE("steps to a tolerance have the same bits in every run, and allocate nothing") {
    for (const Build build : {Build(double_pendulum), Build(sliding_box), Build(thrown_box), Build(resting_boxes)}) {
        const Outcome first = run(build, 1, kStep, 1e-5);
        CHECK(run(build, 1, kStep, 1e-5).hash == first.hash);
    }
    CHECK(run(double_pendulum, 1, kStep, 1e-6).hash != run(double_pendulum, 1, kStep, 1e-5).hash);
    WorldSettings settings;
    settings.tolerance = 1e-5;
    World world(settings);
    double_pendulum(world);
    world.add_body(ground());
    world.add_body(cube(0.5, {5, 0, 0.25}));
    for (int k = 0; k < 120; ++k) world.step(kStep);
    const std::uint64_t before = allocation_count::count();
    for (int k = 0; k < 60; ++k) world.step(kStep);
    CHECK(allocation_count::count() == before);
}
