#include "apps/cli/truths/soundness.hpp"

#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/overlap.hpp"
#include "collision/extent.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace cairn::cli {

namespace {

constexpr Real kMostGain = 0.2;

bool is_driven(const Scene& scene) {
    return std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyDef& b) {
        return b.motion || !b.force.isZero(0) || !b.torque.isZero(0) || b.restitution > 1 ||
               (b.type == BodyType::kKinematic && !(b.linear_velocity.isZero(0) && b.angular_velocity.isZero(0)));
    });
}

// Bodies that overlap at the start by more than a tenth of a size have energy that no state tells of.
bool starts_overlapping(const Scene& scene) {
    History start{{scene.duration}, {{}}};
    Real smallest = HUGE_VAL;
    for (const BodyDef& b : scene.bodies) {
        start.states[0].push_back({b.position, b.rotation, b.linear_velocity, b.angular_velocity});
        for (const Shape& s : b.shapes) {
            if (b.type == BodyType::kDynamic) smallest = std::min(smallest, bounding_radius(s));
        }
    }
    return penetration_error(scene, start).deepest > 0.1 * smallest;
}

struct Energy {
    Real kinetic = 0, potential = 0;
};
Energy energy_of(const Scene& scene, const std::vector<Mat3>& inertia, const std::vector<BodyState>& states) {
    Energy e;
    for (std::size_t i = 0; i < states.size(); ++i) {
        const BodyDef& b = scene.bodies[i];
        if (b.type != BodyType::kDynamic) continue;
        const Vec3 w = states[i].rotation.conjugate() * states[i].angular_velocity;
        e.kinetic += b.mass / 2 * states[i].linear_velocity.squaredNorm() + w.dot(inertia[i] * w) / 2;
        e.potential -= b.mass * scene.gravity.dot(states[i].position);
    }
    return e;
}

bool is_finite(const BodyState& s) {
    return cairn::is_finite(s.position) && cairn::is_finite(s.rotation) && cairn::is_finite(s.linear_velocity) &&
           cairn::is_finite(s.angular_velocity);
}

}  // namespace

Real energy_gain(const Scene& scene, const History& history) {
    if (is_driven(scene)) return 0;
    std::vector<Mat3> inertia(scene.bodies.size(), Mat3::Zero());
    std::vector<BodyState> start;
    Real weights = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& b = scene.bodies[i];
        start.push_back({b.position, b.rotation, b.linear_velocity, b.angular_velocity});
        if (b.type != BodyType::kDynamic) continue;
        inertia[i] = body_inertia(b);
        Real radius = 0;
        for (const Shape& s : b.shapes) radius = std::max(radius, bounding_radius(s));
        weights += b.mass * scene.gravity.norm() * radius;
    }
    const Energy first = energy_of(scene, inertia, start);
    Real rise = 0, lowest = first.potential;
    for (const std::vector<BodyState>& states : history.states) {
        const Energy e = energy_of(scene, inertia, states);
        rise = std::max(rise, e.kinetic + e.potential - first.kinetic - first.potential);
        lowest = std::min(lowest, e.potential);
    }
    return rise / std::max({first.kinetic, first.potential - lowest, weights, 1e-12});
}

bool is_whole(const Scene& scene, const History& history) {
    if (history.t.empty() || history.t.back() < 0.98 * scene.duration - 1e-9) return false;
    for (const std::vector<BodyState>& states : history.states) {
        for (const BodyState& s : states) {
            if (!is_finite(s)) return false;
        }
    }
    return true;
}

std::string unsound(const Scene& scene, const History& history) {
    Real fastest = 0, ground = -HUGE_VAL;
    for (const BodyDef& b : scene.bodies) {
        fastest = std::max(fastest, b.linear_velocity.norm() + 2 * b.angular_velocity.norm());
        for (const Shape& s : b.shapes) {
            const bool level = s.type == ShapeType::kPlane && (b.rotation * s.normal).z() > 0.999 && scene.gravity.z() < 0;
            if (level) ground = b.position.z() + s.offset;
        }
    }
    const bool driven = is_driven(scene);
    const Real limit = 1.5 * (fastest + scene.gravity.norm() * scene.duration) + 10;
    if (history.t.empty() || history.t.back() < 0.98 * scene.duration - 1e-9) return "it ends early";
    for (std::size_t k = 0; k < history.t.size(); ++k) {
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
            const BodyDef& b = scene.bodies[i];
            const BodyState& s = history.states[k][i];
            if (b.type != BodyType::kDynamic) continue;
            if (!is_finite(s)) return fmt::format("{} is not finite at {:.3g} s", b.name, history.t[k]);
            if (!driven && s.linear_velocity.norm() > limit) return fmt::format("{} flies off at {:.3g} s", b.name, history.t[k]);
            if (s.position.z() < ground - 1) return fmt::format("{} fell through the ground by {:.3g} s", b.name, history.t[k]);
        }
    }
    const Real gain = energy_gain(scene, history);
    if (gain > kMostGain && !starts_overlapping(scene)) return fmt::format("the energy rose by {:.0f} % of its scale", 100 * gain);
    return {};
}

}  // namespace cairn::cli
