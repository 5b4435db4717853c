// Against motions that are integrated beside the run.
#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/extrapolation.hpp"
#include "apps/cli/truths/mechanism.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

namespace {

// The length that a position error is relative to: of one body its arm, from the joint to its centre of mass; of rods one after the other
// all of them, from the first joint to the far end of the last rod.
Real mechanism_length(const Scene& scene) {
    const auto arm = [&](const SceneJoint& j) {
        const bool second = j.body_b.has_value();
        const Vec3& pivot = second ? j.def.anchor_a : j.def.type == JointType::kDistance ? j.def.anchor_b : j.def.anchor_a;
        return (scene.bodies[second ? *j.body_b : *j.body_a].position - pivot).norm();
    };
    if (scene.joints.size() == 1) return arm(scene.joints.front());
    Real length = 2 * arm(scene.joints.back());
    for (std::size_t k = 1; k < scene.joints.size(); ++k) {
        length += (scene.joints[k].def.anchor_a - scene.joints[k - 1].def.anchor_a).norm();
    }
    return length;
}

}  // namespace

namespace {

Real position_rms(const Scene& scene, const History& history, Real until) {
    std::vector<Real> times = history.t;
    while (times.size() > 1 && times.back() > until + 1e-9) times.pop_back();
    const std::vector<std::vector<BodyState>> truth = mechanism_reference(scene, times);
    Real sum = 0;
    std::size_t count = 0;
    for (const std::size_t i : dynamic_bodies(scene)) {
        for (std::size_t k = 0; k < truth.size(); ++k, ++count) {
            sum += (history.states[k][i].position - truth[k][i].position).squaredNorm();
        }
    }
    return std::sqrt(sum / static_cast<Real>(count)) / mechanism_length(scene);
}

}  // namespace

// Root of the mean square, over samples and bodies, of the distance from the reference, relative to the mechanism's length.
TruthError reference_position(const Scene& scene, const History& history) {
    return {position_rms(scene, history, history.t.back()), "1", "position, rms", ""};
}

// The same over the first second: many links are chaotic afterwards, and meet one another.
TruthError reference_start(const Scene& scene, const History& history) {
    return {position_rms(scene, history, 1), "1", "position in the first second, rms", ""};
}

// Root of the mean square of the angle between the rotation and the reference's.
TruthError reference_rotation(const Scene& scene, const History& history) {
    const std::vector<std::vector<BodyState>> truth = mechanism_reference(scene, history.t);
    Real sum = 0;
    std::size_t count = 0;
    for (const std::size_t i : dynamic_bodies(scene)) {
        for (std::size_t k = 0; k < truth.size(); ++k, ++count) {
            const Real angle = angle_between(truth[k][i].rotation, history.states[k][i].rotation);
            sum += angle * angle;
        }
    }
    return {std::sqrt(sum / static_cast<Real>(count)), "rad", "rotation, rms", ""};
}

namespace {

// A box that turns about a bottom edge. φ: angle of the way from the edge to the centre of mass past the upright, −φ₀ at the start;
// φ'' = m g R sin φ / I_e, R the distance from the edge, I_e = I + m R² about it (Steiner).
struct Tipping {
    Vec3 axis;  // unit, world: the box turns about it
    Real upright = 0, rate = 0, stiffness = 0;

    Tipping(const Scene& scene, const BodyDef& b) : axis(b.angular_velocity.normalized()), rate(b.angular_velocity.norm()) {
        const Vec3 h = b.shapes.at(0).half_extents, local = b.rotation.conjugate() * axis;
        const Vec3 across = local.cross(Vec3::UnitZ()).cwiseAbs();
        const Real half_width = across.dot(h), R2 = half_width * half_width + h.z() * h.z();
        upright = std::atan2(half_width, h.z());
        const Real inertia = local.dot(body_inertia(b) * local) + b.mass * R2;
        stiffness = b.mass * scene.gravity.norm() * std::sqrt(R2) / inertia;
    }
    // ½ φ'² + k cos φ stays: the box goes over if it is more than k, what it has upright.
    bool topples() const { return rate * rate / 2 + stiffness * std::cos(upright) > stiffness; }
};

}  // namespace

// Tilt against the reference until just before the box is back on its bottom or on its side; root of the mean square, the worst box.
TruthError tipping_box(const Scene& scene, const History& history) {
    TruthError error{0, "rad", "tilt, rms", ""};
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        if (b.angular_velocity.isZero(0)) continue;
        const Tipping box(scene, b);
        const Derivative motion = [&box](Real, const std::vector<Real>& y, std::vector<Real>& dy) {
            dy = {y[1], box.stiffness * std::sin(y[0])};
        };
        // In fine steps, so that the end of the turn is found between two of them.
        const Real h = 1e-3;
        std::vector<Real> y = {-box.upright, box.rate};
        Real end = history.t.back(), now = 0;
        const auto is_over = [&box](Real phi) { return phi + box.upright < -1e-12 || phi + box.upright > kPi / 2; };
        while (now < history.t.back()) {
            std::vector<Real> next = y;
            integrate(motion, 0, h, 1e-13, next);
            if (is_over(next[0])) {  // where the line between both crosses the end; the turn is smooth, h² off at most
                const Real limit = next[0] + box.upright < 0 ? -box.upright : kPi / 2 - box.upright;
                end = now + h * (limit - y[0]) / (next[0] - y[0]);
                break;
            }
            y = next;
            now += h;
        }
        y = {-box.upright, box.rate};
        now = 0;
        Real sum = 0;
        int count = 0;
        for (std::size_t k = 0; k < history.t.size() && history.t[k] <= 0.97 * end; ++k, ++count) {
            if (history.t[k] > now) integrate(motion, now, history.t[k], 1e-13, y);
            now = history.t[k];
            const Vec3 up = history.states[k][i].rotation * Vec3::UnitZ();
            const Real off = std::atan2(Vec3::UnitZ().cross(up).dot(box.axis), up.z()) - (y[0] + box.upright);
            sum += off * off;
        }
        error.value = std::max(error.value, std::sqrt(sum / count));
        const Vec3 up = history.states.back()[i].rotation * Vec3::UnitZ();
        const Real tilt = std::atan2(Vec3::UnitZ().cross(up).dot(box.axis), up.z());
        if ((std::abs(tilt) > kPi / 4) != box.topples())
            error.failed = b.name + (box.topples() ? " should have gone over" : " should have come back");
    }
    return error;
}

}  // namespace cairn::cli
