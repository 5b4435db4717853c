// Each truth gives zero for the exact motion and the size of a known error for a wrong one. Exact motions are worked out here from first
// principles, by other ways than in the truths where there are any.
#include "apps/cli/truths.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <functional>

using namespace cairn;
using namespace cairn::cli;

namespace {

constexpr Real kG = 9.81;
// Sums of a few dozen numbers of size 10 at 16 digits.
constexpr Real kRounding = 1e-12;

BodyDef body(const std::string& name, const Shape& shape) {
    BodyDef b;
    b.name = name;
    b.shapes = {shape};
    return b;
}

BodyDef ground(Real friction, const Vec3& normal = Vec3::UnitZ()) {
    BodyDef b = body("ground", Shape::plane(normal, 0));
    b.type = BodyType::kStatic;
    b.friction = friction;
    return b;
}

// The states of every body at `samples` times up to `duration`; move(i, t, state) starts from the body's own.
History history_of(const Scene& scene, Real duration, int samples, const std::function<void(std::size_t, Real, BodyState&)>& move) {
    History h;
    for (int k = 0; k <= samples; ++k) {
        const Real t = duration * k / samples;
        h.t.push_back(t);
        std::vector<BodyState>& states = h.states.emplace_back();
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
            const BodyDef& b = scene.bodies[i];
            BodyState s{b.position, b.rotation, b.linear_velocity, b.angular_velocity};
            move(i, t, s);
            states.push_back(s);
        }
    }
    return h;
}

void stay(std::size_t, Real, BodyState&) {}

}  // namespace

TEST_CASE("truths are found by the scene's name, or by what it holds") {
    Scene s;
    s.name = "projectile";
    CHECK(truth_of(s).error == parabola);
    s.name = "stack_7";
    CHECK(truth_of(s).error == at_rest);
    s.name = "no_such_scene";
    CHECK(truth_of(s).error == usual_penetration);
    s.joints.resize(1);
    CHECK(truth_of(s).error == joint_separation);
    CHECK(truth_of(s).kind == TruthKind::kInvariant);
}

TEST_CASE("the parabola's truth is zero on it and the distance beside it") {
    Scene s;
    s.bodies = {body("b", Shape::sphere(1))};
    s.bodies[0].position = {1, 2, 3};
    s.bodies[0].linear_velocity = {4, 5, 6};
    const auto fly = [](std::size_t, Real t, BodyState& x) { x.position = Vec3(1 + 4 * t, 2 + 5 * t, 3 + 6 * t - kG * t * t / 2); };
    CHECK(parabola(s, history_of(s, 2, 10, fly)).value < kRounding);
    const auto beside = [&](std::size_t i, Real t, BodyState& x) {
        fly(i, t, x);
        x.position += Vec3(0.03, 0.04, 0) * t;
    };
    CHECK(parabola(s, history_of(s, 2, 10, beside)).value == Approx(0.1));
}

TEST_CASE("the stopping point is v² / 2 μ g ahead") {
    Scene s;
    s.bodies = {ground(0.4), body("b", Shape::box({1, 1, 1}))};
    s.bodies[1].friction = 0.1;  // μ = √(0.4 · 0.1) = 0.2
    s.bodies[1].linear_velocity = {3, 4, 0};
    const Real way = 25 / (2 * 0.2 * kG);
    const auto stopped = [&](std::size_t i, Real t, BodyState& x) {
        if (i == 1 && t > 0) x.position += way * Vec3(0.6, 0.8, 0);
    };
    CHECK(stopping_distance(s, history_of(s, 5, 2, stopped)).value < kRounding);
    const auto short_by_a_tenth = [&](std::size_t i, Real t, BodyState& x) {
        if (i == 1 && t > 0) x.position += 0.9 * way * Vec3(0.6, 0.8, 0);
    };
    CHECK(stopping_distance(s, history_of(s, 5, 2, short_by_a_tenth)).value == Approx(0.1));
}

TEST_CASE("on a slope the truths are those of sliding and of rolling") {
    const Real theta = 0.3;
    const Vec3 n(std::sin(theta), 0, std::cos(theta)), down(std::cos(theta), 0, -std::sin(theta));
    Scene s;
    s.bodies = {ground(0.2, n), body("b", Shape::cylinder(0.5, 1))};
    s.bodies[1].friction = 0.2;
    s.bodies[1].rotation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));  // its axis along y, across the slope
    const auto fall = [&](Real a) {
        return [a, down](std::size_t i, Real t, BodyState& x) {
            if (i == 1) x.position += a * t * t / 2 * down;
        };
    };
    const Real sliding = kG * (std::sin(theta) - 0.2 * std::cos(theta));
    CHECK(sliding_down(s, history_of(s, 2, 4, fall(sliding))).value < kRounding);
    CHECK(sliding_down(s, history_of(s, 2, 4, fall(1.01 * sliding))).value == Approx(0.01));
    const Real rolling = kG * std::sin(theta) / 1.5;  // I = m r² / 2
    CHECK(rolling_down(s, history_of(s, 2, 4, fall(rolling))).value < kRounding);
    CHECK(rolling_down(s, history_of(s, 2, 4, fall(0.98 * rolling))).value == Approx(0.02));
}

TEST_CASE("a ball launched sliding rolls at 5/7") {
    Scene s;
    s.bodies = {ground(0.3), body("b", Shape::sphere(0.4))};
    s.bodies[1].linear_velocity = {0, 7, 0};
    const auto speed = [](Real v) {
        return [v](std::size_t i, Real t, BodyState& x) {
            if (i == 1 && t > 0) x.linear_velocity = {0, v, 0};
        };
    };
    CHECK(rolling_speed(s, history_of(s, 2, 2, speed(5))).value < kRounding);
    CHECK(rolling_speed(s, history_of(s, 2, 2, speed(5.5))).value == Approx(0.1));
}

TEST_CASE("steady rolling and rest are told by the distance from where the body should be") {
    Scene s;
    s.bodies = {ground(0.3), body("b", Shape::sphere(0.4))};
    s.bodies[1].linear_velocity = {2, 0, 0};
    const auto roll = [](std::size_t i, Real t, BodyState& x) {
        if (i == 1) x.position.x() += 2 * t;
    };
    CHECK(steady_rolling(s, history_of(s, 3, 3, roll)).value < kRounding);
    CHECK(steady_rolling(s, history_of(s, 3, 3, stay)).value == Approx(1));
    CHECK(at_rest(s, history_of(s, 3, 3, stay)).value == 0);
    CHECK(at_rest(s, history_of(s, 3, 3, roll)).value == Approx(6));
}

TEST_CASE("apex heights fall by e² and a missing bounce counts as an error of one") {
    Scene s;
    s.bodies = {ground(0), body("b", Shape::sphere(0.25))};
    s.bodies[0].restitution = 0.8;
    s.bodies[1].position = {0, 0, 0.25 + 1.5};
    // Exact flight: fall from h, then arcs of duration 2 v / g with v falling by e.
    const auto bounce = [](Real e) {
        return [e](std::size_t i, Real t, BodyState& x) {
            if (i != 1) return;
            Real v = std::sqrt(2 * kG * 1.5), start = v / kG;
            if (t < start) {
                x.position.z() = 0.25 + 1.5 - kG * t * t / 2;
                x.linear_velocity.z() = -kG * t;
                return;
            }
            for (v *= e; t >= start + 2 * v / kG && v > 1e-3; v *= e) start += 2 * v / kG;
            x.position.z() = 0.25 + v * (t - start) - kG * (t - start) * (t - start) / 2;
            x.linear_velocity.z() = v - kG * (t - start);
        };
    };
    CHECK(bounce_heights(s, history_of(s, 3.5, 210, bounce(0.8))).value < 1e-9);
    // e = 0.78 instead of 0.8: after three bounces (0.78 / 0.8)^6 = 0.859 of the height.
    CHECK(bounce_heights(s, history_of(s, 3.5, 210, bounce(0.78))).value == Approx(1 - std::pow(0.78 / 0.8, 6)));
    CHECK(bounce_heights(s, history_of(s, 3.5, 210, stay)).value == 1);
}

TEST_CASE("equal elastic balls hand the velocity to the last one") {
    Scene s;
    s.gravity = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
        s.bodies.push_back(body("b" + std::to_string(k), Shape::sphere(0.5)));
        s.bodies.back().position = {1.1 * k, 0, 0};
        s.bodies.back().restitution = 1;
    }
    s.bodies[0].linear_velocity = {2, 0, 0};
    const auto handed = [](std::size_t i, Real t, BodyState& x) {
        if (t > 0) x.linear_velocity = Vec3(i == 2 ? 2 : 0, 0, 0);
    };
    CHECK(impact_velocity(s, history_of(s, 1, 2, handed)).value < kRounding);
    CHECK(impact_velocity(s, history_of(s, 1, 2, stay)).value == Approx(1));
}

TEST_CASE("an oblique impact keeps momentum and what Newton and Coulomb say of it") {
    // A ball at 3 m/s hits another at rest so that the line of centres is 45° off its way: u_n = u_t = 3/√2. Equal solid spheres, e = 0.5:
    // normal impulse per mass 1.5 u_n / 2. Sticking would need a tangential impulse per mass of u_t / (2 + 5) = u_t / 7, which is less than
    // μ times the normal one for μ = 1: it sticks.
    const Real r = 0.5, u = 3 / std::sqrt(2.0);
    Scene s;
    s.gravity = Vec3::Zero();
    s.bodies = {body("a", Shape::sphere(r)), body("b", Shape::sphere(r))};
    const Vec3 n = Vec3(1, 1, 0) / std::sqrt(2.0), t = Vec3(1, -1, 0) / std::sqrt(2.0);
    s.bodies[0].position = -2 * r * n - 0.3 * Vec3::UnitX();
    s.bodies[0].linear_velocity = {3, 0, 0};
    for (BodyDef& b : s.bodies) {
        b.restitution = 0.5;
        b.friction = 1;
    }
    const Real J_n = 0.75 * u, J_t = u / 7;  // per mass
    // Torque on both: r × J with J along t at the contact; the spin is 5/2 J_t / r about n × t.
    const Vec3 spin = -2.5 * J_t / r * n.cross(t);
    const auto exact = [&](std::size_t i, Real time, BodyState& x) {
        if (time == 0) return;
        x.linear_velocity = i == 0 ? Vec3((u - J_n) * n + (u - J_t) * t) : Vec3(J_n * n + J_t * t);
        x.angular_velocity = spin;
    };
    CHECK(impact_velocity_and_spin(s, history_of(s, 1, 2, exact)).value < kRounding);
    const auto no_spin = [&](std::size_t i, Real time, BodyState& x) {
        exact(i, time, x);
        x.angular_velocity = Vec3::Zero();
    };
    CHECK(impact_velocity_and_spin(s, history_of(s, 1, 2, no_spin)).value == Approx(spin.norm() * r / 3));
}

TEST_CASE("a pendulum's path is that of small swings when they are small, and comes back after its period") {
    const Real length = 0.7, amplitude = 1e-4;
    Scene s;
    s.bodies = {body("bob", Shape::sphere(1e-4))};  // as good as a point: I / m l² = 0.4e-8 / 0.49
    s.bodies[0].position = {length * std::sin(amplitude), 0, -length * std::cos(amplitude)};
    s.joints.resize(1);
    s.joints[0].body_b = 0;
    const Real w = std::sqrt(kG / length);
    const auto swing = [&](std::size_t, Real t, BodyState& x) {
        const Real a = amplitude * std::cos(w * t);
        x.position = {length * std::sin(a), 0, -length * std::cos(a)};
    };
    // The period of a swing of amplitude α is longer by α²/16 = 6e-10 of itself, and by I's share 4e-9: in 10 s at w α = 4e-4 / s that is
    // below 4e-4 · 10 · 5e-9 = 2e-11.
    CHECK(pendulum_path(s, history_of(s, 10, 20, swing)).value < 1e-10);
    CHECK(pendulum_path(s, history_of(s, kPi / w, 1, stay)).value == Approx(2 * amplitude).epsilon(1e-6));
}

TEST_CASE("a large swing keeps its energy along the pendulum's path") {
    // At the bottom the height is lost: half a period is K(sin(α/2)) · 2 √(l/g) (complete elliptic integral), after it the bob is opposite.
    const Real length = 0.7, amplitude = 2;
    Scene s;
    s.bodies = {body("bob", Shape::sphere(1e-4))};
    s.bodies[0].position = {length * std::sin(amplitude), 0, -length * std::cos(amplitude)};
    s.joints.resize(1);
    s.joints[0].body_b = 0;
    const Real half_period = 2 * std::sqrt(length / kG) * std::comp_ellint_1(std::sin(amplitude / 2));
    const auto opposite = [&](std::size_t, Real t, BodyState& x) {
        if (t > 0) x.position.x() = -x.position.x();
    };
    // I's share of 4e-9 shifts the phase; near the turning point the path is flat in it.
    CHECK(pendulum_path(s, history_of(s, half_period, 1, opposite)).value < 1e-8);
}

TEST_CASE("a slider has its way") {
    Scene s;
    s.bodies = {body("b", Shape::sphere(0.1))};
    s.bodies[0].position = {1, 0, 0};
    s.joints.resize(1);
    s.joints[0].body_b = 0;
    s.joints[0].def.axis = Vec3(0.8, 0, -0.6);
    const auto slide = [](Real factor) {
        return [factor](std::size_t, Real t, BodyState& x) { x.position += factor * 0.6 * kG * t * t / 2 * Vec3(0.8, 0, -0.6); };
    };
    CHECK(sliding_along_axis(s, history_of(s, 2, 4, slide(1))).value < kRounding);
    CHECK(sliding_along_axis(s, history_of(s, 2, 4, slide(1.02))).value == Approx(0.02));
}

TEST_CASE("what must fall, must not pass, must not be thrown and must hold together is told") {
    Scene s;
    s.bodies = {body("a", Shape::sphere(0.1)), body("b", Shape::sphere(0.1)), body("wall", Shape::box({0.02, 4, 4}))};
    s.bodies[2].type = BodyType::kStatic;
    s.bodies[0].position = {-1, 0, 0};
    s.bodies[1].position = {-1, 1, 0};
    const auto fly = [](std::size_t i, Real t, BodyState& x) {
        if (i == 0) x.position.x() += 2 * t;
        if (i == 1) x.position.z() -= kG * t * t / 2;
        if (i == 1) x.linear_velocity.z() = -kG * t;
    };
    const History h = history_of(s, 1, 10, fly);
    CHECK(passed_wall(s, h).value == 0.5);
    CHECK(must_fall(s, h).value == 0);
    CHECK(must_fall(s, history_of(s, 1, 10, stay)).failed != "");
    CHECK(unexplained_speed(s, h).value < 1e-6);  // √ of rounding
    const auto thrown = [&](std::size_t i, Real t, BodyState& x) {
        fly(i, t, x);
        if (i == 0) x.linear_velocity.x() = 2;
    };
    CHECK(unexplained_speed(s, history_of(s, 1, 10, thrown)).value == Approx(2));
    // A chain of one link of 1 m that comes off its first anchor by 0.3 m.
    s.joints.resize(2);
    s.joints[0].body_b = 0;
    s.joints[0].def.anchor_a = s.joints[0].def.anchor_b = {-1, 0, 0};
    s.joints[1].body_a = 0;
    s.joints[1].body_b = 1;
    s.joints[1].def.anchor_a = s.joints[1].def.anchor_b = {-1, 1, 0};
    const auto off = [](std::size_t i, Real t, BodyState& x) {
        if (i < 2) x.position.z() += 0.3 * t;
    };
    CHECK(chain_stretch(s, history_of(s, 1, 3, stay)).value < kRounding);
    CHECK(chain_stretch(s, history_of(s, 1, 3, off)).value == Approx(0.3));
    // Of two samples one is apart, by 0.3 m at one of two joints: √(0.09 / 4).
    CHECK(joint_separation(s, history_of(s, 1, 1, off)).value == Approx(0.15));
}
