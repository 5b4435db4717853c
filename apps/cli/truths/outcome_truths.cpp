// What must happen, what must not, and what every exact motion keeps.
#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/overlap.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

namespace {

Vec3 anchor_now(const Scene& scene, const std::vector<BodyState>& states, const std::optional<std::size_t>& body, const Vec3& anchor) {
    if (!body) return anchor;
    const BodyDef& b = scene.bodies[*body];
    return states[*body].position + states[*body].rotation * (b.rotation.conjugate() * (anchor - b.position));
}

// How far a joint's anchors are apart [m]; of a rod, how far from its length; of a slider, across its axis.
Real separation(const Scene& scene, const std::vector<BodyState>& states, const SceneJoint& j) {
    const bool rod = j.def.type == JointType::kDistance;
    const Vec3 a = anchor_now(scene, states, j.body_a, j.def.anchor_a);
    const Vec3 d = anchor_now(scene, states, j.body_b, rod ? j.def.anchor_b : j.def.anchor_a) - a;
    if (rod) return std::abs(d.norm() - (j.def.anchor_a - j.def.anchor_b).norm());
    if (j.def.type != JointType::kSlider) return d.norm();
    Vec3 axis = j.def.axis.normalized();
    if (j.body_a) axis = states[*j.body_a].rotation * (scene.bodies[*j.body_a].rotation.conjugate() * axis);
    return (d - d.dot(axis) * axis).norm();
}

}  // namespace

// No set of contact forces holds it up: at least two bodies are over half a metre away at the end. 1 if not.
TruthError must_fall(const Scene& scene, const History& history) {
    int moved = 0;
    for (const std::size_t i : dynamic_bodies(scene)) {
        moved += (history.states.back()[i].position - scene.bodies[i].position).norm() > 0.5 ? 1 : 0;
    }
    TruthError error{moved >= 2 ? 0.0 : 1.0, "0/1", "stands that should fall", ""};
    if (moved < 2) error.failed = "it stands";
    return error;
}

// Nothing passes the wall, which is the first static box: share of the dynamic bodies whose centres have been on its other side.
TruthError passed_wall(const Scene& scene, const History& history) {
    for (const BodyDef& wall : scene.bodies) {
        if (wall.type != BodyType::kStatic || wall.shapes.empty() || wall.shapes.front().type != ShapeType::kBox) continue;
        int thin = 0;
        wall.shapes.front().half_extents.minCoeff(&thin);
        const Vec3 n = wall.rotation * Vec3::Unit(thin);
        const std::vector<std::size_t> balls = dynamic_bodies(scene);
        int passed = 0;
        for (const std::size_t i : balls) {
            const Real side = n.dot(scene.bodies[i].position - wall.position);
            passed += std::any_of(history.states.begin(), history.states.end(),
                                  [&](const std::vector<BodyState>& s) { return side * n.dot(s[i].position - wall.position) < 0; })
                          ? 1
                          : 0;
        }
        return {static_cast<Real>(passed) / static_cast<Real>(balls.size()), "1", "share that passed", ""};
    }
    throw Error(scene.name + ": bodies, must be a static box");
}

// Bodies that overlap at the start are parted without a throw: the largest speed that no fall explains, √(v² − 2 g Δh).
TruthError unexplained_speed(const Scene& scene, const History& history) {
    const Vec3 up = -scene.gravity.normalized();
    const Real g = scene.gravity.norm();
    TruthError error{0, "m/s", "speed not from a fall", ""};
    for (const std::size_t i : dynamic_bodies(scene)) {
        for (const std::vector<BodyState>& states : history.states) {
            const Real fall = std::max(0.0, up.dot(scene.bodies[i].position - states[i].position));
            error.value = std::max(error.value, std::sqrt(std::max(0.0, states[i].linear_velocity.squaredNorm() - 2 * g * fall)));
        }
    }
    return error;
}

// Length of the line through a chain's anchors, with what its first anchor has left its place, relative to the true length.
TruthError chain_stretch(const Scene& scene, const History& history) {
    Real length = 0;
    for (std::size_t k = 1; k < scene.joints.size(); ++k) {
        length += (scene.joints[k].def.anchor_a - scene.joints[k - 1].def.anchor_a).norm();
    }
    TruthError error{0, "1", "stretch", ""};
    for (const std::vector<BodyState>& states : history.states) {
        Real now = 0, first = 0;
        Vec3 before = Vec3::Zero();
        for (std::size_t k = 0; k < scene.joints.size(); ++k) {
            const SceneJoint& j = scene.joints[k];
            const Vec3 anchor = anchor_now(scene, states, j.body_b, j.def.anchor_a);
            if (k == 0) first = (anchor - j.def.anchor_a).norm();
            if (k > 0) now += (anchor - before).norm();
            before = anchor;
        }
        error.value = std::max(error.value, (std::abs(now - length) + first) / length);
    }
    return error;
}

// Root of the mean square of all joints' separations over all samples.
TruthError joint_separation(const Scene& scene, const History& history) {
    Real sum = 0;
    for (const std::vector<BodyState>& states : history.states) {
        for (const SceneJoint& j : scene.joints) {
            const Real s = separation(scene, states, j);
            sum += s * s;
        }
    }
    const Real count = static_cast<Real>(history.states.size() * scene.joints.size());
    return {count > 0 ? std::sqrt(sum / count) : 0, "m", "joint separation, rms", ""};
}

TruthError deepest_penetration(const Scene& scene, const History& history) {
    return {penetration_error(scene, history).deepest, "m", "deepest penetration", ""};
}

TruthError usual_penetration(const Scene& scene, const History& history) {
    return {penetration_error(scene, history).percentile99, "m", "penetration, 99th percentile", ""};
}

}  // namespace cairn::cli
