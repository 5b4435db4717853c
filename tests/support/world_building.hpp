// Short ways to say a world in a test.
#pragma once

#include "engine/world.hpp"

#include <random>
#include <string>
#include <utility>

namespace world_building {

using namespace cairn;

constexpr Real kG = 9.81;
constexpr Real kStep = 1.0 / 60;  // [s]

inline BodyDef fixed(const Shape& shape, const Vec3& position = Vec3::Zero(), Real friction = 0.5) {
    BodyDef b;
    b.name = "fixed";
    b.type = BodyType::kStatic;
    b.position = position;
    b.shapes = {shape};
    b.friction = friction;
    return b;
}

inline BodyDef ground(Real friction = 0.5, Real restitution = 0) {
    BodyDef b = fixed(Shape::plane(Vec3::UnitZ(), 0), Vec3::Zero(), friction);
    b.name = "ground";
    b.restitution = restitution;
    return b;
}

inline BodyDef body(const Shape& shape, const Vec3& position, Real mass = 1, Real friction = 0.5) {
    BodyDef b;
    b.name = "body";
    b.position = position;
    b.shapes = {shape};
    b.mass = mass;
    b.friction = friction;
    return b;
}

inline BodyDef cube(Real side, const Vec3& position, Real mass = 1, Real friction = 0.5) {
    return body(Shape::box(Vec3::Constant(side / 2)), position, mass, friction);
}

inline BodyDef ball(Real radius, const Vec3& position, Real mass = 1, Real friction = 0.5) {
    return body(Shape::sphere(radius), position, mass, friction);
}

inline Quat turn(const Vec3& axis, Real angle) {
    return exp_rotation(angle * axis.normalized());
}

inline WorldSettings no_gravity() {
    WorldSettings s;
    s.gravity.setZero();
    return s;
}

// Steps for `duration` [s]; `each(report)` after every step.
template <typename Each>
void run(World& world, Real duration, Real dt, Each each) {
    const int steps = static_cast<int>(std::lround(duration / dt));
    for (int k = 0; k < steps; ++k) each(world.step(dt));
}
inline void run(World& world, Real duration, Real dt = kStep) {
    run(world, duration, dt, [](const StepReport&) {});
}

// Σ λ_N [N s] of the points between a static body and others, along `up`.
inline Real ground_impulse(const World& world, const Vec3& up = Vec3::UnitZ()) {
    Real sum = 0;
    for (const ManifoldView& m : world.manifolds()) {
        const Real sign = (world.type(m.body_b) == BodyType::kStatic) - (world.type(m.body_a) == BodyType::kStatic);
        for (int k = 0; k < m.count; ++k) sum += sign * up.dot(m.n) * m.points[k].normal_impulse;
    }
    return sum;
}

inline Vec3 linear_momentum(const World& world) {
    Vec3 p = Vec3::Zero();
    for (BodyId id : world.bodies())
        if (world.type(id) == BodyType::kDynamic) p += world.mass(id) * world.state(id).linear_velocity;
    return p;
}

// About the world's origin.
inline Vec3 angular_momentum(const World& world) {
    Vec3 L = Vec3::Zero();
    for (BodyId id : world.bodies()) {
        if (world.type(id) != BodyType::kDynamic) continue;
        const BodyState s = world.state(id);
        const Mat3 R = s.rotation.toRotationMatrix();
        L += world.mass(id) * s.position.cross(s.linear_velocity) + R * (world.inertia(id) * (R.transpose() * s.angular_velocity));
    }
    return L;
}

// Numbers that are the same with every standard library (its distributions are not).
class Random {
public:
    explicit Random(std::uint32_t seed) : generator_(seed) {}
    Real uniform(Real low, Real high) { return low + (high - low) * static_cast<Real>(generator_()) / 4294967295.0; }
    Vec3 vector(Real size) {
        const Real x = uniform(-size, size), y = uniform(-size, size), z = uniform(-size, size);
        return {x, y, z};
    }
    Quat rotation() { return exp_rotation(vector(3)); }
    int below(int n) { return static_cast<int>(generator_() % static_cast<std::uint32_t>(n)); }

private:
    std::mt19937 generator_;
};

// One of the five solid shapes, of about half a metre.
inline Shape random_shape(Random& r) {
    const Real a = r.uniform(0.15, 0.3), b = r.uniform(0.15, 0.3), c = r.uniform(0.15, 0.3);
    switch (r.below(5)) {
        case 0:
            return Shape::sphere(a);
        case 1:
            return Shape::capsule(a, b);
        case 2:
            return Shape::cylinder(a, b);
        case 3:
            return Shape::convex({{a, 0, 0}, {-a, 0, 0}, {0, b, 0}, {0, -b, 0}, {0, 0, c}, {0, 0, -c}});
        default:
            return Shape::box({a, b, c});
    }
}

}  // namespace world_building
