// Free flight, joints and rest; contact_truths.cpp has what slides, rolls and bounces.
#include "apps/cli/truths.hpp"

#include "apps/cli/truth_parts.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

namespace {

TruthError at_rest_of(const Scene& scene, const History& history, const std::string& prefix) {
    TruthError error{0, "m", "drift", ""};
    int toppled = 0;
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        if (b.name.compare(0, prefix.size(), prefix) != 0) continue;
        bool turned = false;
        for (const std::vector<BodyState>& states : history.states) {
            error.value = std::max(error.value, (states[i].position - b.position).norm());
            turned = turned || angle_between(b.rotation, states[i].rotation) > kPi / 6;
        }
        toppled += turned ? 1 : 0;
    }
    if (toppled > 0) error.failed = std::to_string(toppled) + " toppled";
    return error;
}

// A rest of some bodies alone: those whose names begin so.
TruthError stacks_at_rest(const Scene& scene, const History& history) {
    return at_rest_of(scene, history, "stack");
}
TruthError boxes_at_rest(const Scene& scene, const History& history) {
    return at_rest_of(scene, history, "box");
}

// What joints hold may hang as it likes: it is no wreck.
TruthError held_at_rest(const Scene& scene, const History& history) {
    TruthError error = at_rest_of(scene, history, "");
    error.failed.clear();
    return error;
}

struct NamedTruth {
    const char* scene;  // a name, or the beginning of names before a *
    Truth truth;
};
constexpr TruthKind kClosed = TruthKind::kClosedForm, kReference = TruthKind::kReference, kInvariant = TruthKind::kInvariant;
constexpr NamedTruth kTruths[] = {
    {"projectile", {parabola, kClosed}},
    {"spread_*", {parabola, kClosed}},
    {"slide_stop", {stopping_distance, kClosed}},
    {"mesh_slide", {stopping_distance, kClosed}},
    {"incline_stick", {creep, kClosed}},
    {"incline_slip", {sliding_down, kClosed}},
    {"slide_roll", {rolling_speed, kClosed}},
    {"roll_incline", {rolling_down, kClosed}},
    {"cylinders", {steady_rolling, kClosed}},
    {"bounce", {bounce_heights, kClosed}},
    {"cradle", {impact_velocity, kClosed}},
    {"oblique", {impact_velocity_and_spin, kClosed}},
    {"slider", {sliding_along_axis, kClosed}},
    {"torque_free", {reference_rotation, kReference}},
    {"pendulum", {reference_position, kReference}},
    {"double_pendulum", {reference_position, kReference}},
    {"rod_pendulum", {reference_position, kReference}},
    {"top", {reference_position, kReference}},
    {"top_spin", {reference_position, kReference}},
    {"tip", {tipping_box, kReference}},
    {"cantilever", {held_at_rest, kClosed}},
    {"fixed_beam", {held_at_rest, kClosed}},
    {"stack_*", {at_rest, kClosed}},
    {"pyramid_*", {at_rest, kClosed}},
    {"heavy_on_light*", {at_rest, kClosed}},
    {"card_house", {at_rest, kClosed}},
    {"arch", {at_rest, kClosed}},
    {"wedge", {at_rest, kClosed}},
    {"overhang_stable", {at_rest, kClosed}},
    {"tiny_on_huge", {stacks_at_rest, kClosed}},
    {"mostly_resting", {boxes_at_rest, kClosed}},
    {"overhang_unstable", {must_fall, kClosed}},
    {"tunnel", {passed_wall, kClosed}},
    {"overlap", {unexplained_speed, kInvariant}},
    {"chain_*", {chain_stretch, kInvariant, reference_start}},
    {"ball_vs_stack", {deepest_penetration, kInvariant}},
};

constexpr std::size_t kMostJointsOfPaths = 16;

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

const char* to_string(TruthKind kind) {
    switch (kind) {
        case TruthKind::kClosedForm:
            return "closed form";
        case TruthKind::kReference:
            return "reference";
        case TruthKind::kInvariant:
            return "invariant";
    }
    return "unknown";
}

Truth truth_of(const Scene& scene) {
    for (const NamedTruth& named : kTruths) {
        if (!is_named(scene.name, named.scene)) continue;
        Truth truth = named.truth;
        // Beyond that the reference would take longer than the runs: its work grows with the cube of the joints.
        if (scene.joints.size() > kMostJointsOfPaths) truth.path = nullptr;
        return truth;
    }
    if (!scene.joints.empty()) return {joint_separation, kInvariant};
    return {usual_penetration, kInvariant};
}

// p(t) = p₀ + v₀ t + g t² / 2 for every dynamic body.
TruthError parabola(const Scene& scene, const History& history) {
    TruthError error{0, "m", "off the parabola", ""};
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
    TruthError error{0, "1", "off the pendulum's path", ""};
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

// On a slider along the unit axis u: p(t) = p₀ + u (u·v₀ t + u·g t² / 2), relative to the way at the end.
TruthError sliding_along_axis(const Scene& scene, const History& history) {
    const SceneJoint& joint = world_joint(scene);
    const std::size_t i = held_body(joint);
    const BodyDef& b = scene.bodies[i];
    const Vec3& u = joint.def.axis;
    const auto way = [&](Real t) { return u.dot(b.linear_velocity) * t + u.dot(scene.gravity) * t * t / 2; };
    TruthError error{0, "1", "way along the axis", ""};
    for (std::size_t k = 0; k < history.t.size(); ++k) {
        const Vec3 p = b.position + way(history.t[k]) * u;
        error.value = std::max(error.value, (history.states[k][i].position - p).norm() / std::abs(way(history.t.back())));
    }
    return error;
}

// Nothing moves: largest displacement of any dynamic body. One that turned by over 30° has toppled.
TruthError at_rest(const Scene& scene, const History& history) {
    return at_rest_of(scene, history, "");
}

}  // namespace cairn::cli
