// Free flight, joints and rest; contact_truths.cpp has what slides, rolls and bounces.
#include "apps/cli/truths.hpp"

#include "apps/cli/truth_parts.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

namespace {

struct NamedTruth {
    const char* scene;
    TruthFunction truth;
};
constexpr NamedTruth kTruths[] = {
    {"projectile", parabola},      {"torque_free", momentum_kept}, {"slide_stop", stopping_distance}, {"mesh_slide", stopping_distance},
    {"incline_stick", at_rest},    {"incline_slip", sliding_down}, {"slide_roll", rolling_speed},     {"roll_incline", rolling_down},
    {"cylinders", steady_rolling}, {"bounce", bounce_heights},     {"cradle", cradle_exchange},       {"pendulum", pendulum_path},
    {"rod_pendulum", rod_length},  {"slider", sliding_along_axis}, {"top", axial_momentum},           {"fixed_beam", at_rest},
    {"stack_10", at_rest},         {"pyramid_10", at_rest},        {"pyramid_40", at_rest},           {"card_house", at_rest},
    {"heavy_on_light", at_rest},
};

// The first joint of the scene that holds a body to the world, and that body.
const SceneJoint& world_joint(const Scene& scene) {
    for (const SceneJoint& joint : scene.joints) {
        if (joint.body_a.has_value() != joint.body_b.has_value()) return joint;
    }
    throw Error(scene.name + ": joints, must be one to the world");
}

std::size_t held_body(const SceneJoint& joint) {
    return joint.body_a ? *joint.body_a : *joint.body_b;
}

Mat3 world_inertia(const BodyDef& body, const BodyState& s) {
    const Mat3 R = s.rotation.toRotationMatrix();
    return R * body_inertia(body) * R.transpose();
}

}  // namespace

TruthFunction truth_of(const std::string& scene_name) {
    for (const NamedTruth& named : kTruths) {
        if (scene_name == named.scene) return named.truth;
    }
    return nullptr;
}

// p(t) = p₀ + v₀ t + g t² / 2 for every dynamic body.
TruthError parabola(const Scene& scene, const History& history) {
    TruthError error{0, "m", "off the parabola"};
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        for (std::size_t k = 0; k < history.t.size(); ++k) {
            const Real t = history.t[k];
            const Vec3 p = b.position + t * b.linear_velocity + t * t / 2 * scene.gravity;
            error.value = std::max(error.value, (history.states[k][i].position - p).norm());
        }
    }
    return error;
}

// Without a torque the angular momentum L = R I Rᵀ ω stays as it was, direction and all; relative to ‖L₀‖.
TruthError momentum_kept(const Scene& scene, const History& history) {
    TruthError error{0, "1", "angular momentum"};
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        const BodyState start{b.position, b.rotation, b.linear_velocity, b.angular_velocity};
        const Vec3 L0 = world_inertia(b, start) * b.angular_velocity;
        for (const std::vector<BodyState>& states : history.states) {
            const Vec3 L = world_inertia(b, states[i]) * states[i].angular_velocity;
            error.value = std::max(error.value, (L - L0).norm() / L0.norm());
        }
    }
    return error;
}

// A physical pendulum in its plane: I_p θ'' = m g·(∂p/∂θ), I_p = I + m l² about the pivot (Steiner), integrated by the classical
// fourth-order rule in steps of at most 0.1 ms, whose own error is far below 1e-10 l. Largest distance of the centre of mass, relative to
// l.
TruthError pendulum_path(const Scene& scene, const History& history) {
    const SceneJoint& joint = world_joint(scene);
    const std::size_t i = held_body(joint);
    const BodyDef& b = scene.bodies[i];
    const Vec3 arm0 = b.position - joint.def.anchor_a;
    const Real l = arm0.norm();
    const Vec3 down = scene.gravity.normalized();
    const Vec3 axis = down.cross(arm0).normalized();  // θ, from `down` towards the arm, grows about it
    const Vec3 side = axis.cross(down);
    const Mat3 I = world_inertia(b, {b.position, b.rotation, {}, {}});
    const Real k = b.mass * scene.gravity.norm() * l / (axis.dot(I * axis) + b.mass * l * l);
    Real theta = std::atan2(arm0.dot(side), arm0.dot(down)), rate = b.angular_velocity.dot(axis), now = 0;
    TruthError error{0, "1", "off the pendulum's path"};
    for (std::size_t n = 0; n < history.t.size(); ++n) {
        const int steps = static_cast<int>(std::ceil((history.t[n] - now) / 1e-4));
        const Real h = steps > 0 ? (history.t[n] - now) / steps : 0;
        for (int s = 0; s < steps; ++s) {
            const Real a1 = -k * std::sin(theta), r1 = rate;
            const Real a2 = -k * std::sin(theta + h / 2 * r1), r2 = rate + h / 2 * a1;
            const Real a3 = -k * std::sin(theta + h / 2 * r2), r3 = rate + h / 2 * a2;
            const Real a4 = -k * std::sin(theta + h * r3), r4 = rate + h * a3;
            theta += h / 6 * (r1 + 2 * r2 + 2 * r3 + r4);
            rate += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
        }
        now = history.t[n];
        const Vec3 p = joint.def.anchor_a + l * (std::cos(theta) * down + std::sin(theta) * side);
        error.value = std::max(error.value, (history.states[n][i].position - p).norm() / l);
    }
    return error;
}

// A rigid rod keeps its length. The rod of the scene ends in the body's centre of mass; relative to the length.
TruthError rod_length(const Scene& scene, const History& history) {
    const SceneJoint& joint = world_joint(scene);
    const std::size_t i = held_body(joint);
    const Vec3 pivot = joint.body_a ? joint.def.anchor_b : joint.def.anchor_a;
    const Real length = (joint.def.anchor_a - joint.def.anchor_b).norm();
    TruthError error{0, "1", "rod length"};
    for (const std::vector<BodyState>& states : history.states) {
        error.value = std::max(error.value, std::abs((states[i].position - pivot).norm() - length) / length);
    }
    return error;
}

// On a slider along the unit axis u: p(t) = p₀ + u (u·v₀ t + u·g t² / 2), relative to the way at the end.
TruthError sliding_along_axis(const Scene& scene, const History& history) {
    const SceneJoint& joint = world_joint(scene);
    const std::size_t i = held_body(joint);
    const BodyDef& b = scene.bodies[i];
    const Vec3& u = joint.def.axis;
    const auto way = [&](Real t) { return u.dot(b.linear_velocity) * t + u.dot(scene.gravity) * t * t / 2; };
    TruthError error{0, "1", "way along the axis"};
    for (std::size_t k = 0; k < history.t.size(); ++k) {
        const Vec3 p = b.position + way(history.t[k]) * u;
        error.value = std::max(error.value, (history.states[k][i].position - p).norm() / std::abs(way(history.t.back())));
    }
    return error;
}

// A body held at a pivot: gravity has no torque about the vertical through it, so (r × m v + R I Rᵀ ω)·ĝ stays; relative to ‖L₀‖.
TruthError axial_momentum(const Scene& scene, const History& history) {
    const SceneJoint& joint = world_joint(scene);
    const std::size_t i = held_body(joint);
    const BodyDef& b = scene.bodies[i];
    const Vec3 vertical = scene.gravity.normalized();
    const auto momentum = [&](const BodyState& s) {
        return Vec3((s.position - joint.def.anchor_a).cross(b.mass * s.linear_velocity) + world_inertia(b, s) * s.angular_velocity);
    };
    const Vec3 L0 = momentum({b.position, b.rotation, b.linear_velocity, b.angular_velocity});
    TruthError error{0, "1", "vertical angular momentum"};
    for (const std::vector<BodyState>& states : history.states) {
        error.value = std::max(error.value, std::abs(vertical.dot(momentum(states[i]) - L0)) / L0.norm());
    }
    return error;
}

// Nothing moves: largest displacement of any dynamic body.
TruthError at_rest(const Scene& scene, const History& history) {
    TruthError error{0, "m", "drift"};
    for (const std::size_t i : dynamic_bodies(scene)) {
        for (const std::vector<BodyState>& states : history.states) {
            error.value = std::max(error.value, (states[i].position - scene.bodies[i].position).norm());
        }
    }
    return error;
}

}  // namespace cairn::cli
