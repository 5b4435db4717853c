// The references that runs are held against, by laws that they were not made from.
#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/extrapolation.hpp"
#include "apps/cli/truths/mechanism.hpp"
#include "apps/cli/truths/overlap.hpp"
#include "apps/cli/truths/soundness.hpp"
#include "tests/support/catch.hpp"

#include <cmath>

using namespace cairn;
using namespace cairn::cli;

namespace {

constexpr Real kG = 9.81;

BodyDef box(const Vec3& half, const Vec3& position) {
    BodyDef b;
    b.name = "box";
    b.shapes = {Shape::box(half)};
    b.position = position;
    return b;
}

SceneJoint joint(JointType type, const Vec3& anchor, std::size_t body, const Vec3& axis = Vec3::UnitY()) {
    SceneJoint j;
    j.def.type = type;
    j.def.anchor_a = j.def.anchor_b = anchor;
    j.def.axis = axis;
    j.body_b = body;
    return j;
}

std::vector<Real> times(Real end, int count) {
    std::vector<Real> list;
    for (int k = 0; k <= count; ++k) list.push_back(end * k / count);
    return list;
}

Real energy(const Scene& s, const std::vector<BodyState>& states) {
    Real sum = 0;
    for (std::size_t i = 0; i < s.bodies.size(); ++i) {
        const Vec3 w = states[i].rotation.conjugate() * states[i].angular_velocity;
        sum += s.bodies[i].mass * (states[i].linear_velocity.squaredNorm() / 2 - s.gravity.dot(states[i].position)) +
               w.dot(body_inertia(s.bodies[i]) * w) / 2;
    }
    return sum;
}

}  // namespace

TEST_CASE("the extrapolation integrates a swing of many periods to twelve digits") {
    std::vector<Real> y = {1, 0};
    const Derivative swing = [](Real, const std::vector<Real>& x, std::vector<Real>& dx) { dx = {x[1], -x[0]}; };
    integrate(swing, 0, 50, 1e-13, y);
    CHECK(std::abs(y[0] - std::cos(50.0)) < 1e-11);  // 50 rad, some 1e-13 a step
    CHECK(std::abs(y[1] + std::sin(50.0)) < 1e-11);
    // A kink cannot be integrated smoothly; a step that is small enough is found all the same, or it is said that there is none.
    y = {0};
    integrate([](Real t, const std::vector<Real>&, std::vector<Real>& dx) { dx = {std::exp(t)}; }, 0, 1, 1e-13, y);
    CHECK(y[0] == Approx(std::exp(1.0) - 1).epsilon(1e-13));
}

TEST_CASE("a free symmetric body spins and precesses at the rates of Poinsot") {
    // Body frame: ω₁ + i ω₂ turns at Ω = ω₃ (I₃ − I₁) / I₁; the figure axis goes round L at ‖L‖ / I₁.
    Scene s;
    s.gravity = Vec3::Zero();
    s.bodies = {box({1, 1, 1}, Vec3::Zero())};
    s.bodies[0].inertia = Vec3(2, 2, 3);
    const Vec3 w0(0.5, 0, 4);
    s.bodies[0].angular_velocity = w0;
    const Vec3 L(2 * w0.x(), 0, 3 * w0.z());
    const std::vector<Real> t = times(5, 10);
    const std::vector<std::vector<BodyState>> states = mechanism_reference(s, t);
    for (std::size_t k = 0; k < t.size(); ++k) {
        const Quat about_L(Eigen::AngleAxis<Real>(L.norm() / 2 * t[k], L.normalized()));
        CHECK((states[k][0].rotation * Vec3::UnitZ() - about_L * Vec3::UnitZ()).norm() < 1e-10);  // 30 rad at some 1e-12
        const Real turn = w0.z() * 0.5 * t[k];
        const Vec3 body = states[k][0].rotation.conjugate() * states[k][0].angular_velocity;
        CHECK((body - Vec3(0.5 * std::cos(turn), 0.5 * std::sin(turn), 4)).norm() < 1e-10);
    }
}

TEST_CASE("the reference of a pendulum is the pendulum's own equation in one angle") {
    Scene s;
    s.bodies = {box({0.05, 0.08, 0.4}, {0.4 * std::sin(2.0), 0, -0.4 * std::cos(2.0)})};
    s.bodies[0].rotation = Quat(Eigen::AngleAxis<Real>(-2.0, Vec3::UnitY()));
    for (const JointType type : {JointType::kHinge, JointType::kBall}) {
        s.joints = {joint(type, Vec3::Zero(), 0)};
        History h;
        h.t = times(3, 30);
        h.states = mechanism_reference(s, h.t);
        CHECK(pendulum_path(s, h).value < 1e-9);  // of which most is the other integrator's, at 0.1 ms
    }
}

TEST_CASE("references of every joint keep energy and hold together") {
    Scene s;
    s.bodies = {box({0.3, 0.2, 0.1}, {0.5, 0, 0}), box({0.1, 0.2, 0.3}, {1.5, 0, 0.1})};
    s.bodies[1].angular_velocity = Vec3::Zero();
    for (const JointType type : {JointType::kBall, JointType::kHinge, JointType::kSlider, JointType::kFixed, JointType::kDistance}) {
        CAPTURE(static_cast<int>(type));
        s.joints = {joint(JointType::kBall, Vec3::Zero(), 0), joint(type, {1, 0, 0.05}, 1, Vec3(0.6, 0.8, 0))};
        s.joints[1].body_a = 0;
        if (type == JointType::kDistance) s.joints[1].def.anchor_b = {1.4, 0, 0.05};
        History h;
        h.t = times(1, 10);
        h.states = mechanism_reference(s, h.t);
        const Real start = energy(s, h.states.front());
        CHECK(std::abs(energy(s, h.states.back()) - start) < 1e-9);  // of some 10 J that change hands
        CHECK(joint_separation(s, h).value < 1e-9);
        CHECK((h.states.back()[1].position - h.states.front()[1].position).norm() > 0.1);
        CHECK(reference_position(s, h).value < 1e-15);
    }
}

TEST_CASE("the start of a chain is compared over its first second alone") {
    Scene s;
    s.bodies = {box({0.3, 0.2, 0.1}, {0.5, 0, 0})};
    s.joints = {joint(JointType::kBall, Vec3::Zero(), 0)};
    History h;
    h.t = times(2, 20);
    h.states = mechanism_reference(s, h.t);
    const auto off_at = [&](Real t) {
        History moved = h;
        for (std::size_t k = 0; k < h.t.size(); ++k) {
            if (std::abs(h.t[k] - t) < 1e-9) moved.states[k][0].position.x() += 0.1;
        }
        return reference_start(s, moved).value;
    };
    // 0.1 m at one of eleven samples, relative to the arm of 0.5 m.
    CHECK(off_at(1) == Approx(0.1 / 0.5 / std::sqrt(11.0)));
    CHECK(off_at(1.1) < 1e-15);
    CHECK(reference_position(s, h).value < 1e-15);
}

TEST_CASE("a box that tips follows the equation of its one angle") {
    // Small turn back and forth about the edge is not harmonic; but the time it takes to the top is known from the energy: the box stands
    // still at φ where ½ ω² I = m g R (cos φ − cos φ₀), and comes back with the speed that it left with.
    Scene s;
    BodyDef ground = box({1, 1, 1}, Vec3::Zero());
    ground.type = BodyType::kStatic;
    ground.shapes = {Shape::plane(Vec3::UnitZ(), 0)};
    s.bodies = {ground, box({0.4, 0.5, 0.8}, {0, 0, 0.8})};
    s.bodies[1].angular_velocity = {0, -1.0, 0};
    const Real R2 = 0.4 * 0.4 + 0.8 * 0.8, I = body_inertia(s.bodies[1])(1, 1) + R2, k = kG * std::sqrt(R2) / I,
               phi0 = std::atan2(0.4, 0.8);
    History h;
    h.t = times(2, 200);
    Real phi = -phi0, rate = 1;
    for (std::size_t n = 0; n < h.t.size(); ++n) {
        BodyState x{s.bodies[1].position, Quat(Eigen::AngleAxis<Real>(-(phi + phi0), Vec3::UnitY())), Vec3::Zero(), Vec3::Zero()};
        h.states.push_back({BodyState{}, x});
        for (int j = 0; j < 1000 && phi >= -phi0; ++j) {  // leapfrog, second order: 1e-5² · some = 1e-9
            rate += 0.5e-5 * k * std::sin(phi);
            phi += 1e-5 * rate;
            rate += 0.5e-5 * k * std::sin(phi);
        }
        if (phi < -phi0) {
            phi = -phi0;
            rate = 0;
        }
    }
    const TruthError error = tipping_box(s, h);
    CHECK(error.value < 1e-7);
    CHECK(error.failed == "");
    for (std::vector<BodyState>& states : h.states) states[1].rotation = Quat::Identity();
    CHECK(tipping_box(s, h).value > 0.05);
}

TEST_CASE("depths are those of closed forms, whatever way the shapes are turned") {
    const Quat q = Quat(Eigen::AngleAxis<Real>(0.7, Vec3(1, 2, 3).normalized()));
    const Vec3 p(0.3, -0.2, 0.5);
    const Pose X{q, p};
    const auto moved = [&](const Vec3& by, const Quat& turn = Quat::Identity()) { return X * Pose{turn, by}; };
    const Shape ball = Shape::sphere(0.5), cube = Shape::box({0.5, 0.5, 0.5}), rod = Shape::capsule(0.2, 0.5),
                can = Shape::cylinder(0.4, 0.5);
    std::vector<Vec3> corners;
    for (int k = 0; k < 8; ++k) corners.push_back({k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5});
    const Shape hull = Shape::convex(corners);
    constexpr Real kSearch = 1e-7;  // the search ends at steps of 1e-9; where the least overlap is flat its value is far closer
    CHECK(overlap_depth(ball, X, ball, moved({0.9, 0, 0})) == Approx(0.1));
    CHECK(overlap_depth(ball, X, ball, moved({1.1, 0, 0})) == 0);
    CHECK(overlap_depth(cube, X, cube, moved({0.2, 0.1, 0.97})) == Approx(0.03));
    CHECK(overlap_depth(hull, X, cube, moved({0.2, 0.1, 0.97})) == Approx(0.03));
    CHECK(overlap_depth(hull, X, hull, moved({0, 0, 1.2})) == 0);
    CHECK(overlap_depth(ball, X, cube, moved({0, 0, 0.98})) == Approx(0.02));
    CHECK(overlap_depth(cube, X, ball, moved({0.1, 0, 0})) == Approx(0.9));  // centre inside: 0.4 to the face and the radius
    CHECK(std::abs(overlap_depth(can, X, can, moved({0.1, 0, 0.95})) - 0.05) < kSearch);
    CHECK(std::abs(overlap_depth(can, X, can, moved({0.55, 0.55, 0})) - (0.8 - 0.55 * std::sqrt(2.0))) < kSearch);
    CHECK(std::abs(overlap_depth(rod, X, rod, moved({0.3, 0, 0.2})) - 0.1) < kSearch);
    const Quat across(Eigen::AngleAxis<Real>(kPi / 2, Vec3::UnitX()));
    CHECK(std::abs(overlap_depth(rod, X, rod, moved({0.35, 0, 0}, across)) - 0.05) < kSearch);
    // A capsule against an edge of the cube, along the diagonal: the edge is √½ away from the middle.
    const Vec3 diagonal = Vec3(1, 1, 0).normalized();
    CHECK(std::abs(overlap_depth(rod, moved((std::sqrt(0.5) + 0.15) * diagonal), cube, X) - 0.05) < kSearch);
    CHECK(std::abs(overlap_depth(ball, moved((std::sqrt(0.5) + 0.45) * diagonal), hull, X) - 0.05) < kSearch);
    CHECK(overlap_depth(Shape::plane(Vec3::UnitZ(), 0), X, can, moved({3, 1, 0.4})) == Approx(0.1));
}

TEST_CASE("the 99th percentile of depths counts each body once a sample") {
    Scene s;
    for (int k = 0; k < 3; ++k) {
        s.bodies.push_back(box({0.5, 0.5, 0.5}, {0.0, 0, 0.98 * k}));
    }
    History h;
    h.t = {0, 1, 2};
    std::vector<BodyState> states;
    for (const BodyDef& b : s.bodies) states.push_back({b.position, b.rotation, Vec3::Zero(), Vec3::Zero()});
    h.states = {states, states, states};
    for (BodyState& x : h.states[2]) x.position *= 2;  // all apart
    // Six numbers: three of 0.02, three of 0; the percentile is between the two largest.
    CHECK(penetration_error(s, h).deepest == Approx(0.02));
    CHECK(penetration_error(s, h).percentile99 == Approx(0.02));
    h.states[0][0].position.z() = 0.5;  // t = 0 does not count
    CHECK(penetration_error(s, h).deepest == Approx(0.02));
}

TEST_CASE("runs that cannot be are unsound") {
    Scene s;
    s.duration = 1;
    s.bodies = {box({0.5, 0.5, 0.5}, {0, 0, 0.5}), box({1, 1, 1}, Vec3::Zero())};
    s.bodies[1].type = BodyType::kStatic;
    s.bodies[1].shapes = {Shape::plane(Vec3::UnitZ(), 0)};
    History h;
    h.t = {0, 1};
    const BodyState rest{{0, 0, 0.5}, Quat::Identity(), Vec3::Zero(), Vec3::Zero()};
    h.states = {{rest, {}}, {rest, {}}};
    CHECK(unsound(s, h) == "");
    CHECK(energy_gain(s, h) == 0);
    h.states[1][0].position.z() = -2;
    CHECK(unsound(s, h).find("fell through") != std::string::npos);
    h.states[1][0].position.z() = 0.5 + 0.5 * std::sqrt(0.75);  // m g z over m g times the radius √¾: half its scale
    CHECK(energy_gain(s, h) == Approx(0.5));
    CHECK(unsound(s, h).find("energy") != std::string::npos);
    h.states[1][0].linear_velocity.x() = 100;
    CHECK(unsound(s, h).find("flies off") != std::string::npos);
    h.states[1][0].linear_velocity.x() = std::nan("");
    CHECK(unsound(s, h).find("not finite") != std::string::npos);
    CHECK(!is_whole(s, h));
    h.t.back() = 0.5;
    CHECK(unsound(s, h) == "it ends early");
}
