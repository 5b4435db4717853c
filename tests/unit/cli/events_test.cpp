// What must have happened in a run: free flight, support, and the events of named scenes.
#include "apps/cli/truths/events.hpp"
#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/flight.hpp"
#include "apps/cli/truths/mechanism.hpp"
#include "apps/cli/truths/overlap.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <functional>

using namespace cairn;
using namespace cairn::cli;

namespace {

BodyDef body(const Shape& shape, const Vec3& position, const std::string& name = "body") {
    BodyDef b;
    b.name = name;
    b.shapes = {shape};
    b.position = position;
    return b;
}

BodyDef ground() {
    BodyDef b = body(Shape::plane(Vec3::UnitZ(), 0), Vec3::Zero(), "ground");
    b.type = BodyType::kStatic;
    return b;
}

SceneJoint ball_joint(const Vec3& anchor, const std::optional<std::size_t>& a, std::size_t b) {
    SceneJoint j;
    j.def.type = JointType::kBall;
    j.def.anchor_a = j.def.anchor_b = anchor;
    j.body_a = a;
    j.body_b = b;
    return j;
}

// Every body of the scene where `place` says, at 21 times of [0, end].
History history(const Scene& scene, Real end, const std::function<BodyState(std::size_t body, Real t)>& place) {
    History h;
    for (int k = 0; k <= 20; ++k) {
        h.t.push_back(end * k / 20);
        h.states.emplace_back();
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) h.states.back().push_back(place(i, h.t.back()));
    }
    return h;
}

BodyState start_of(const BodyDef& b) {
    return {b.position, b.rotation, b.linear_velocity, b.angular_velocity};
}

// Falls with this share of gravity.
std::function<BodyState(std::size_t, Real)> falling(const Scene& scene, Real share) {
    return [&scene, share](std::size_t i, Real t) {
        BodyState s = start_of(scene.bodies[i]);
        if (scene.bodies[i].type != BodyType::kDynamic) return s;
        s.position += t * s.linear_velocity + share * t * t / 2 * scene.gravity;
        s.linear_velocity += share * t * scene.gravity;
        return s;
    };
}

}  // namespace

TEST_CASE("what has touched nothing must be on its parabola until something may have touched it") {
    Scene s;
    s.bodies = {ground(), body(Shape::box({0.3, 0.3, 0.3}), {0, 0, 5})};
    // It is 0.52 m around its middle, so it is free for √(2 · 4.48 / 9.81) = 0.95 s.
    CHECK(free_flight(s, history(s, 0.9, falling(s, 1))).off == 0);
    CHECK(free_flight(s, history(s, 0.9, falling(s, 0.9))).off == 1);
    CHECK(free_flight(s, history(s, 0.9, falling(s, 0))).off == 1);
    CHECK(free_flight(s, history(s, 2, falling(s, 1))).worst < 1e-12);  // below the ground nobody asks
    // Symplectic Euler in steps of 1/60 s is g t / 120 off.
    const History euler = history(s, 0.9, [&](std::size_t i, Real t) {
        BodyState x = falling(s, 1)(i, t);
        if (i == 1) x.position += t / 120 * s.gravity;
        return x;
    });
    CHECK(free_flight(s, euler).off == 0);
    CHECK(missing_event(s, history(s, 0.9, falling(s, 0))) != "");
}

TEST_CASE("a free flight is not asked for from where two bodies may meet") {
    Scene s;
    s.gravity = Vec3::Zero();
    s.bodies = {body(Shape::sphere(0.1), {0, 0, 0}), body(Shape::sphere(0.1), {2, 0, 0}), body(Shape::sphere(0.1), {0, 9, 0})};
    s.bodies[0].linear_velocity = {1, 0, 0};
    // They meet after 1.8 s; all stands still from there on.
    const auto stopping = [&](Real from) {
        return [&s, from](std::size_t i, Real t) {
            BodyState x = start_of(s.bodies[i]);
            x.position += std::min(t, from) * x.linear_velocity;
            return x;
        };
    };
    CHECK(free_flight(s, history(s, 2, stopping(1.8))).off == 0);
    CHECK(free_flight(s, history(s, 2, stopping(1.5))).off == 1);
}

TEST_CASE("bodies that joints tie fly by their common centre of mass; what hangs does not fly") {
    Scene s;
    s.bodies = {body(Shape::sphere(0.1), {0, 0, 9}), body(Shape::sphere(0.1), {1, 0, 9})};
    s.bodies[1].mass = 3;
    s.joints = {ball_joint({0.5, 0, 9}, 0, 1)};
    const History swings = history(s, 0.5, [&](std::size_t i, Real t) {
        BodyState x = falling(s, 1)(i, t);
        x.position.y() += i == 0 ? 3 * t : -t;
        return x;
    });
    CHECK(free_flight(s, swings).of == 1);
    CHECK(free_flight(s, swings).off == 0);
    s.bodies[1].mass = 1;
    CHECK(free_flight(s, swings).off == 1);
    s.joints.push_back(ball_joint({0, 0, 9}, std::nullopt, 0));
    CHECK(free_flight(s, swings).of == 0);
    CHECK(jointed_groups(s).tied == std::vector<bool>{true, true});
}

TEST_CASE("what is at rest must lie on something within two centimetres") {
    Scene s;
    s.bodies = {ground(), body(Shape::box({0.5, 0.5, 0.5}), {0, 0, 0.5}), body(Shape::box({0.5, 0.5, 0.5}), {0.3, 0.2, 1.5})};
    const auto still = [&s](Real gap_low, Real gap_high) {
        return history(s, 1, [&s, gap_low, gap_high](std::size_t i, Real) {
            BodyState x = start_of(s.bodies[i]);
            x.position.z() += i == 1 ? gap_low : i == 2 ? gap_low + gap_high : 0;
            return x;
        });
    };
    CHECK(supported(s, still(0, 0), 0.05).of == 2);
    CHECK(supported(s, still(0, 0), 0.05).hovering == 0);
    CHECK(supported(s, still(0.01, 0.015), 0.05).hovering == 0);
    CHECK(supported(s, still(0.03, 0), 0.05).hovering == 1);
    CHECK(supported(s, still(0.03, 0.03), 0.05).hovering == 2);
    CHECK(supported(s, still(0, 0.5), 0.05).hovering == 1);
    CHECK(missing_event(s, still(0.03, 0)) != "");
    // In a group one is enough; beside something is not on it.
    s.joints = {ball_joint({0, 0, 1}, 1, 2)};
    CHECK(supported(s, still(0, 0.5), 0.05).hovering == 0);
    s.joints.clear();
    s.bodies[2].position = {1.001, 0, 0.9};
    CHECK(supported(s, still(0, 0), 0.05).hovering == 1);
}

TEST_CASE("the gap below a body is its distance from what bears it") {
    Scene s;
    s.bodies = {ground(), body(Shape::sphere(0.2), {0, 0, 0.23}), body(Shape::capsule(0.1, 0.3), {3, 0, 0.14})};
    s.bodies[2].rotation = Quat(Eigen::AngleAxis<Real>(kPi / 2, Vec3::UnitY()));
    s.bodies.push_back(body(Shape::sphere(0.2), {0.1, 0, 0.63}));  // 0.0123 above the first: √(0.1² + 0.4²) − 0.4
    std::vector<BodyState> states;
    for (const BodyDef& b : s.bodies) states.push_back(start_of(b));
    const std::vector<Real> gaps = support_gaps(s, states);
    CHECK(gaps[1] == Approx(0.03));
    CHECK(gaps[2] == Approx(0.04));
    CHECK(gaps[3] == Approx(std::sqrt(0.17) - 0.4));
}

TEST_CASE("a chain that does not fall as chains do has failed") {
    Scene s;
    s.name = "chain_2";
    s.duration = 3;
    s.bodies = {body(Shape::box({0.5, 0.05, 0.05}), {0.5, 0, 0}), body(Shape::box({0.5, 0.05, 0.05}), {1.5, 0, 0})};
    s.joints = {ball_joint({0, 0, 0}, std::nullopt, 0), ball_joint({1, 0, 0}, 0, 1)};
    History h = history(s, 3, falling(s, 0));
    CHECK(missing_event(s, h).find("its end is off") == 0);
    h.states = mechanism_reference(s, h.t);
    CHECK(missing_event(s, h) == "");
    History stays = h;
    for (std::size_t k = 5; k < h.t.size(); ++k) stays.states[k] = h.states[4];
    CHECK(missing_event(s, stays) == "it does not swing through");
    History fast = h;
    fast.states[1][1].linear_velocity.y() += 3;
    CHECK(missing_event(s, fast).find("its energy changes") == 0);
}

TEST_CASE("what must move, turn, reach or stay inside has failed if it does not") {
    Scene s;
    s.gravity = Vec3::Zero();
    for (int k = 0; k < 5; ++k) s.bodies.push_back(body(Shape::box({0.1, 0.1, 0.1}), {1.0 * k, 0, 0}, "brick" + std::to_string(k)));
    s.name = "wall_hit";
    const auto end_at = [&s](const std::function<void(std::size_t, BodyState&)>& change) {
        History h = history(s, 1, falling(s, 1));
        for (std::size_t i = 0; i < s.bodies.size(); ++i) change(i, h.states.back()[i]);
        return h;
    };
    for (BodyDef& b : s.bodies) b.force = {1e-9, 0, 0};  // pushed, so no flight is asked for
    CHECK(missing_event(s, end_at([](std::size_t, BodyState& x) { x.position.y() += 0.6; })) == "");
    CHECK(missing_event(s, end_at([](std::size_t i, BodyState& x) { x.position.y() += i > 0 ? 0.6 : 0; })) != "");
    s.name = "domino_5";
    for (BodyDef& b : s.bodies) b.name.replace(0, 5, "domino");
    const Quat over(Eigen::AngleAxis<Real>(0.8, Vec3::UnitX()));
    CHECK(missing_event(s, end_at([&](std::size_t, BodyState& x) { x.rotation = over; })) == "");
    CHECK(missing_event(s, end_at([&](std::size_t i, BodyState& x) { x.rotation = i == 3 ? x.rotation : over; })) != "");
    s.name = "tunnel";
    s.bodies.resize(1);
    s.bodies[0].linear_velocity = {1, 0, 0};
    BodyDef wall = body(Shape::box({0.02, 1, 1}), {3, 0, 0}, "wall");
    wall.type = BodyType::kStatic;
    s.bodies.push_back(wall);
    CHECK(missing_event(s, end_at([](std::size_t, BodyState&) {})) != "");
    s.bodies[1].position.x() = 1.1;
    CHECK(missing_event(s, end_at([](std::size_t, BodyState&) {})) == "");
    s.name = "mesh_slide";
    s.gravity = {0, 0, -9.81};
    s.bodies[0].shapes = {Shape::sphere(0.1)};
    CHECK(missing_event(s, end_at([](std::size_t, BodyState& x) { x.linear_velocity = {0, 0, 0.04}; })) == "");
    CHECK(missing_event(s, end_at([](std::size_t, BodyState& x) { x.linear_velocity = {0, 0, 0.06}; })).find("hops") != std::string::npos);
    s.name = "pile_1";
    s.bodies[1].position = {0, 0, 0};
    s.bodies[1].shapes = {Shape::box({2, 2, 0.1})};
    const auto lies_at = [&](Real x) {
        return end_at([x](std::size_t i, BodyState& b) {
            if (i == 0) b = {{x, 0, 0.2}, Quat::Identity(), {0.1, 0, 0}, Vec3::Zero()};
        });
    };
    CHECK(missing_event(s, lies_at(1)) == "");
    CHECK(missing_event(s, lies_at(3)).find("left the container") != std::string::npos);
    s.name = "maze";
    s.bodies[1].type = BodyType::kKinematic;
    s.bodies[1].motion = RotateSine{Vec3::UnitX(), 0.1, 1, 0};
    CHECK(missing_event(s, lies_at(1)).find("does not turn") != std::string::npos);
}
