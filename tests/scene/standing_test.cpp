// What stands costs nothing and is not asleep: whatever happens to it acts in the same step.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <functional>

using namespace cairn;
using namespace world_building;

namespace {

// A table on a plinth that a caller may drive, three boxes on each other, a fourth beside them that leans on nothing, and a ball far above.
struct Scene {
    World world;
    BodyId ground_id, plinth, low, middle, high, beside, ball_id;

    Scene() {
        ground_id = world.add_body(ground());
        BodyDef driven = body(Shape::box({2, 2, 0.25}), {0, 0, 0.25});
        driven.type = BodyType::kKinematic;
        plinth = world.add_body(driven);
        low = world.add_body(cube(1, {0, 0, 1}));
        middle = world.add_body(cube(1, {0.2, 0.1, 2}, 3));
        high = world.add_body(cube(1, {0.1, 0, 3}));
        beside = world.add_body(cube(0.5, {1.2, 0, 0.75}));
        ball_id = world.add_body(ball(0.2, {0.1, 0.1, 6}, 2));
    }

    void wake_all() {
        for (const BodyId id : world.bodies()) world.wake(id);
    }
};

void drive(Scene& s, const Vec3& velocity) {
    BodyState state = s.world.state(s.plinth);
    state.linear_velocity = velocity;
    s.world.set_state(s.plinth, state);
}

using Touch = std::function<void(Scene&)>;

struct NamedTouch {
    const char* name;
    Touch touch;
};

const NamedTouch kTouches[] = {
    {"nothing: the ball falls on the stack", [](Scene&) {}},
    {"the lowest box is taken away", [](Scene& s) { s.world.remove_body(s.low); }},
    {"the plinth is taken away", [](Scene& s) { s.world.remove_body(s.plinth); }},
    {"the plinth begins to move",
     [](Scene& s) {
         drive(s, {0.3, 0, 0});
     }},
    {"the plinth sinks",
     [](Scene& s) {
         drive(s, {0, 0, -20});
     }},
    {"the plinth is put elsewhere",
     [](Scene& s) {
         BodyState state = s.world.state(s.plinth);
         state.position.x() += 3;
         s.world.set_state(s.plinth, state);
     }},
    {"the middle is pushed",
     [](Scene& s) {
         s.world.apply_impulse(s.middle, {4, 1, 0}, s.world.state(s.middle).position);
     }},
    {"the lowest is pulled by a force",
     [](Scene& s) {
         s.world.set_force(s.low, {60, 0, 0}, Vec3::Zero());
     }},
    {"the middle is put elsewhere",
     [](Scene& s) {
         BodyState state = s.world.state(s.middle);
         state.position.x() += 1.5;
         s.world.set_state(s.middle, state);
     }},
    {"gravity turns",
     [](Scene& s) {
         s.world.set_gravity({6, 0, -7.7});
     }},
    {"gravity ends", [](Scene& s) { s.world.set_gravity(Vec3::Zero()); }},
    {"a box comes on top",
     [](Scene& s) {
         s.world.add_body(cube(1, {0.6, 0, 4}));
     }},
    {"a joint ties the top to the world",
     [](Scene& s) {
         JointDef joint{JointType::kBall, s.high, BodyId(), {0.1, 0, 3.5}, {0.1, 0, 3.5}, Vec3::UnitZ()};
         s.world.add_joint(joint);
     }},
};

}  // namespace

TEST_CASE("what stands is neither solved nor moved, and says what it bears") {
    World world;
    world.add_body(ground());
    for (int k = 0; k < 5; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    const StepReport solved = world.step(kStep);
    run(world, 0.1);
    std::vector<BodyState> before;
    for (const BodyId id : world.bodies()) before.push_back(world.state(id));
    for (int k = 0; k < 10; ++k) {
        const StepReport report = world.step(kStep);
        CHECK(report.contact_sweeps == 0);
        CHECK(report.factorisations == 0);
        CHECK(report.islands_of[static_cast<int>(SolverChoice::kDirect)] == 1);
        CHECK(report.normal_rows == solved.normal_rows);
        CHECK(report.friction_rows == solved.friction_rows);
        CHECK(report.contacts == solved.contacts);
        CHECK(report.manifolds_reused == solved.manifolds);
    }
    std::size_t k = 0;
    for (const BodyId id : world.bodies()) {
        CHECK(world.state(id).position == before[k].position);
        CHECK(world.state(id).linear_velocity.isZero(0));
        ++k;
    }
    // Σ λ = m g h to the residual that a step may end with, 1e-9 m/s of 0.16.
    CHECK(std::abs(ground_impulse(world) / (5 * kG * kStep) - 1) < 1e-8);
}

// The same world, but woken before every step, so that nothing ever stands: both must take the same way. They differ by rounding before
// they are touched, and what tips or is hit makes more of it, and of which rows are swept in which order: 1e-6 m is far below what a step
// changes.
TEST_CASE("whatever happens to what stands acts as if it had never stood") {
    for (const NamedTouch& t : kTouches) {
        CAPTURE(t.name);
        Scene standing, woken;
        for (int k = 0; k < 24; ++k) {
            standing.world.step(kStep);
            woken.wake_all();
            woken.world.step(kStep);
        }
        t.touch(standing);
        t.touch(woken);
        for (int k = 0; k < 40; ++k) {
            standing.world.step(kStep);
            woken.wake_all();
            woken.world.step(kStep);
        }
        for (const BodyId id : standing.world.bodies()) {
            CAPTURE(id.index);
            CHECK((standing.world.state(id).position - woken.world.state(id).position).norm() < 1e-6);
        }
    }
}

// A step of another length bears the same weight by other impulses.
TEST_CASE("what stands bears its weight in steps of any length") {
    World world;
    world.add_body(ground());
    world.add_body(cube(1, {0, 0, 0.5}));
    run(world, 0.2);
    for (const Real dt : {1.0 / 60, 1.0 / 240, 1.0 / 30}) {
        world.step(dt);
        world.step(dt);
        CHECK(std::abs(ground_impulse(world) / (kG * dt) - 1) < 1e-8);
    }
}

TEST_CASE("what a billionth of its weight pulls does not stand") {
    World world;
    world.add_body(ground(0));
    BodyDef box = cube(1, {0, 0, 0.5}, 2, 0);
    const Real a = 1e-9 * kG, t = 2;
    box.force = {2 * a, 0, 0};
    const BodyId id = world.add_body(box);
    run(world, t);
    CHECK(std::abs(world.state(id).position.x() / (a * t * t / 2) - 1) < 1e-3);
}

// θ̈ = (3 g / 4 r) θ about the edge of a cube, r half its diagonal: 10.4 /s² for a side of one metre. Its first step makes 1e-7 m/s of
// 1e-6 rad, a hundred times what may be taken for nothing; in two seconds it makes 3e-4 rad of it.
TEST_CASE("a box that is balanced on its edge to a millionth of a radian does not stand") {
    for (const Real off : {0.0, 1e-6}) {
        World world;
        world.add_body(ground(0.9));
        BodyDef box = cube(1, {0, 0, std::sqrt(0.5)}, 1, 0.9);
        box.rotation = turn(Vec3::UnitY(), kPi / 4 + off);
        const BodyId id = world.add_body(box);
        run(world, 2);
        CAPTURE(off);
        const Real tilt = world.state(id).linear_velocity.norm();
        if (off > 0) CHECK(tilt > 1e-5);
    }
}
