// What slides, rolls and bounces on the ground.
#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

namespace {

// Gravity's part along the ground, and its size into the ground.
struct Slope {
    Vec3 n;
    Vec3 along;
    Real into = 0;
    explicit Slope(const Scene& scene)
        : n(ground_normal(scene)), along(scene.gravity - scene.gravity.dot(n) * n), into(-scene.gravity.dot(n)) {}
};

}  // namespace

// A block launched with v₀ on level ground stops after v₀² / (2 μ g), straight ahead; distance from that point relative to the way.
TruthError stopping_distance(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    const BodyDef& b = scene.bodies[i];
    const Real v = b.linear_velocity.norm();
    const Real way = v * v / (2 * ground_friction(scene, i) * scene.gravity.norm());
    const Vec3 stop = b.position + way / v * b.linear_velocity;
    return {(history.states.back()[i].position - stop).norm() / way, "1", "stopping point"};
}

// From rest on a slope of angle θ with too little friction: g (sin θ − μ cos θ) t² / 2 down the slope, relative.
TruthError sliding_down(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    const Slope slope(scene);
    const Real a = slope.along.norm() - ground_friction(scene, i) * slope.into;
    const Real t = history.t.back(), way = a * t * t / 2;
    const Vec3 p = scene.bodies[i].position + way * slope.along.normalized();
    return {(history.states.back()[i].position - p).norm() / way, "1", "way down the slope"};
}

// A ball launched with v₀ without spin slides, then rolls on at v₀ / (1 + I / m r²), which is 5/7 v₀; relative to v₀. (The friction's
// impulse J changes m v by −J and I ω by J r; it rolls when v = ω r.)
TruthError rolling_speed(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    const BodyDef& b = scene.bodies[i];
    const Vec3 axis = ground_normal(scene).cross(b.linear_velocity).normalized();
    const Vec3 v = b.linear_velocity / (1 + rolling_factor(b, axis));
    return {(history.states.back()[i].linear_velocity - v).norm() / b.linear_velocity.norm(), "1", "rolling speed"};
}

// Round bodies from rest on a slope with enough friction: g sin θ / (1 + I / m r²) · t² / 2 down the slope, relative; the worst of them.
TruthError rolling_down(const Scene& scene, const History& history) {
    const Slope slope(scene);
    const Vec3 down = slope.along.normalized();
    const Real t = history.t.back();
    TruthError error{0, "1", "way down the slope"};
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        const Real way = slope.along.norm() / (1 + rolling_factor(b, slope.n.cross(down))) * t * t / 2;
        const Vec3 p = b.position + way * down;
        error.value = std::max(error.value, (history.states.back()[i].position - p).norm() / way);
    }
    return error;
}

// On level ground what rolls goes on at its speed and what rests stays: p₀ + v₀ t; largest distance.
TruthError steady_rolling(const Scene& scene, const History& history) {
    TruthError error{0, "m", "off its way"};
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        for (std::size_t k = 0; k < history.t.size(); ++k) {
            const Vec3 p = b.position + history.t[k] * b.linear_velocity;
            error.value = std::max(error.value, (history.states[k][i].position - p).norm());
        }
    }
    return error;
}

// A ball dropped from a height h over its resting one rises to e^(2n) h after n bounces. In flight each sample gives the apex that it is on
// the way to or from, h + v² / 2g; the sample highest above the ground is taken, so that none in the middle of an impact is. Worst
// relative error of the first three bounces; one that is missing counts as 1.
TruthError bounce_heights(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    const BodyDef& b = scene.bodies[i];
    const Vec3 up = -scene.gravity.normalized();
    const Real g = scene.gravity.norm();
    Real ground = 0, e = b.restitution;
    for (const BodyDef& other : scene.bodies) {
        for (const Shape& shape : other.shapes) {
            if (shape.type != ShapeType::kPlane) continue;
            ground = up.dot(other.position) + shape.offset;
            e = std::max(b.restitution, other.restitution);
        }
    }
    const auto height = [&](const BodyState& s) { return s.position.dot(up) - ground - b.shapes.at(0).radius; };
    const Real drop = height({b.position, b.rotation, {}, {}});
    constexpr int kBounces = 3;
    Real highest[kBounces + 1] = {0, 0, 0, 0}, apex[kBounces + 1] = {0, 0, 0, 0};
    int bounce = 0;
    Real last_speed = 0;
    for (const std::vector<BodyState>& states : history.states) {
        const Real speed = states[i].linear_velocity.dot(up);
        if (last_speed < 0 && speed > 0) ++bounce;
        last_speed = speed;
        if (bounce > kBounces) break;
        const Real h = height(states[i]);
        if (h < highest[bounce]) continue;
        highest[bounce] = h;
        apex[bounce] = h + speed * speed / (2 * g);
    }
    TruthError error{0, "1", "apex height"};
    for (int n = 1; n <= kBounces; ++n) {
        const Real truth = std::pow(e, 2 * n) * drop;
        error.value = std::max(error.value, n <= bounce ? std::abs(apex[n] - truth) / truth : 1);
    }
    return error;
}

// Equal elastic balls in a line hand the first one's velocity on to the last, and all others stand; worst velocity error relative to v₀.
TruthError cradle_exchange(const Scene& scene, const History& history) {
    const std::vector<std::size_t> balls = dynamic_bodies(scene);
    const Vec3 v0 = scene.bodies[balls.front()].linear_velocity;
    TruthError error{0, "1", "final velocity"};
    for (const std::size_t i : balls) {
        const Vec3 v = i == balls.back() ? v0 : Vec3::Zero();
        error.value = std::max(error.value, (history.states.back()[i].linear_velocity - v).norm() / v0.norm());
    }
    return error;
}

}  // namespace cairn::cli
