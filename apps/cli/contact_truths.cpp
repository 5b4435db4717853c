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
    Vec3 flat(const Vec3& v) const { return v - v.dot(n) * n; }
};

}  // namespace

// A block launched with v₀ on level ground stops after v₀² / (2 μ g), straight ahead; distance from that point in
// the plane relative to the way.
TruthError stopping_distance(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    const BodyDef& b = scene.bodies[i];
    const Real v = b.linear_velocity.norm();
    const Real way = v * v / (2 * ground_friction(scene, i) * scene.gravity.norm());
    const Vec3 stop = b.position + way / v * b.linear_velocity;
    return {Slope(scene).flat(history.states.back()[i].position - stop).norm() / way, "1", "stopping point", ""};
}

// From rest on a slope of angle θ with too little friction: g (sin θ − μ cos θ) t² / 2 down the slope, relative,
// in the plane.
TruthError sliding_down(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    const Slope slope(scene);
    const Real a = slope.along.norm() - ground_friction(scene, i) * slope.into;
    const Real t = history.t.back(), way = a * t * t / 2;
    const Vec3 p = scene.bodies[i].position + way * slope.along.normalized();
    return {slope.flat(history.states.back()[i].position - p).norm() / way, "1", "way down the slope", ""};
}

// A ball launched with v₀ without spin slides, then rolls on at v₀ / (1 + I / m r²), which is 5/7 v₀; relative to that. (The friction's
// impulse J changes m v by −J and I ω by J r; it rolls when v = ω r.)
TruthError rolling_speed(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    const BodyDef& b = scene.bodies[i];
    const Vec3 axis = ground_normal(scene).cross(b.linear_velocity).normalized();
    const Vec3 v = b.linear_velocity / (1 + rolling_factor(b, axis));
    return {Slope(scene).flat(history.states.back()[i].linear_velocity - v).norm() / v.norm(), "1", "rolling speed", ""};
}

// Round bodies from rest on a slope with enough friction: g sin θ / (1 + I / m r²) · t² / 2 down the slope, relative; the worst of them.
TruthError rolling_down(const Scene& scene, const History& history) {
    const Slope slope(scene);
    const Vec3 down = slope.along.normalized();
    const Real t = history.t.back();
    TruthError error{0, "1", "way down the slope", ""};
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        const Real way = slope.along.norm() / (1 + rolling_factor(b, slope.n.cross(down))) * t * t / 2;
        const Vec3 p = b.position + way * down;
        error.value = std::max(error.value, slope.flat(history.states.back()[i].position - p).norm() / way);
    }
    return error;
}

// On level ground what rolls goes on at its speed: p₀ + v₀ t at the end, in the plane, relative to the way; the worst body that starts with
// a speed.
TruthError steady_rolling(const Scene& scene, const History& history) {
    const Slope ground(scene);
    TruthError error{0, "1", "way rolled", ""};
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        if (b.linear_velocity.isZero(0)) continue;
        const Vec3 way = history.t.back() * b.linear_velocity;
        const Vec3 off = ground.flat(history.states.back()[i].position - b.position - way);
        error.value = std::max(error.value, off.norm() / ground.flat(way).norm());
    }
    return error;
}

// A block with enough friction stays on its slope: how far it has moved along it at the end.
TruthError creep(const Scene& scene, const History& history) {
    const std::size_t i = dynamic_bodies(scene).front();
    return {Slope(scene).flat(history.states.back()[i].position - scene.bodies[i].position).norm(), "m", "creep", ""};
}

// A ball dropped from a height h over its resting one rises to e^(2n) h after n bounces (with a start upwards or downwards: of the height
// that its energy is worth). In flight each sample gives the apex that it is on the way to or from, h + v² / 2g; the median of each flight
// is taken, so that a sample in the middle of an impact does not count. Worst relative error of the first three bounces; one that is
// missing counts as 1.
TruthError bounce_heights(const Scene& scene, const History& history) {
    constexpr int kBounces = 3;
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
    const auto height = [&](const Vec3& p) { return p.dot(up) - ground - b.shapes.at(0).radius; };
    const Real speed0 = b.linear_velocity.dot(up), drop = height(b.position) + speed0 * speed0 / (2 * g);
    std::vector<std::vector<Real>> flights(1);
    Real last = 0;
    for (std::size_t k = 0; k < history.states.size(); ++k) {
        const BodyState& s = history.states[k][i];
        const Real speed = s.linear_velocity.dot(up);
        if (k > 0 && speed > 0 && last <= 0) flights.emplace_back();
        last = speed;
        flights.back().push_back(height(s.position) + speed * speed / (2 * g));
    }
    TruthError error{0, "1", "apex height", ""};
    for (std::size_t n = 1; n <= kBounces; ++n) {
        const Real truth = std::pow(e, 2 * static_cast<Real>(n)) * drop;
        error.value = std::max(error.value, n < flights.size() ? std::abs(median(flights[n]) - truth) / truth : 1);
    }
    return error;
}

}  // namespace cairn::cli
