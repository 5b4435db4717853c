#include "apps/cli/truths/events.hpp"

#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/flight.hpp"
#include "apps/cli/truths/mechanism.hpp"
#include "apps/cli/truths/overlap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn::cli {

namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
constexpr Real kAtRest = 0.05, kSlow = 0.5;  // [m/s]

bool is_called(const BodyDef& b, const std::string& prefix) {
    return b.type == BodyType::kDynamic && b.name.compare(0, prefix.size(), prefix) == 0;
}

// At least `count` of the bodies whose names begin so are farther from their start than `way` at the end.
std::string moves(const Scene& scene, const History& history, const std::string& prefix, Real way, int count) {
    int moved = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const Vec3 d = history.states.back()[i].position - scene.bodies[i].position;
        moved += is_called(scene.bodies[i], prefix) && d.norm() > way ? 1 : 0;
    }
    return moved >= count ? "" : fmt::format("{} of the {}s moved, at least {} must", moved, prefix, count);
}

std::string bricks_move(const Scene& scene, const History& history) {
    return moves(scene, history, "brick", 0.5, 5);
}
std::string boxes_move(const Scene& scene, const History& history) {
    return moves(scene, history, "box", 0.5, 3);
}
std::string balls_move(const Scene& scene, const History& history) {
    return moves(scene, history, "ball", 0.3, 15);
}

std::string dominoes_fall(const Scene& scene, const History& history) {
    int standing = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (!is_called(scene.bodies[i], "domino")) continue;
        const bool falls = std::any_of(history.states.begin(), history.states.end(), [&](const std::vector<BodyState>& s) {
            return angle_between(scene.bodies[i].rotation, s[i].rotation) > 0.7;
        });
        standing += falls ? 0 : 1;
    }
    return standing == 0 ? "" : fmt::format("{} dominoes stand", standing);
}

// A body of a mesh's slope goes down it and never hops.
std::string balls_do_not_hop(const Scene& scene, const History& history) {
    constexpr Real kHop = 0.05;  // [m/s]
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& b = scene.bodies[i];
        if (b.type != BodyType::kDynamic || b.shapes.empty() || b.shapes.front().type != ShapeType::kSphere) continue;
        for (const std::vector<BodyState>& s : history.states) {
            const Real up = -s[i].linear_velocity.dot(scene.gravity.normalized());
            if (up > kHop) return fmt::format("{} hops at {:.2g} m/s", b.name, up);
        }
    }
    return {};
}

std::string parts_at_the_end(const Scene& scene, const History& history) {
    const History end{{history.t.back()}, {history.states.back()}};
    const Real depth = penetration_error(scene, end).deepest;
    return depth <= 0.05 ? "" : fmt::format("still {:.2g} m deep at the end", depth);
}

// Every ball comes to the wall (the first static body), goes through it or comes back from it.
std::string balls_reach_the_wall(const Scene& scene, const History& history) {
    for (const BodyDef& wall : scene.bodies) {
        if (wall.type != BodyType::kStatic || wall.shapes.empty() || wall.shapes.front().type != ShapeType::kBox) continue;
        int thin = 0;
        const Real half = wall.shapes.front().half_extents.minCoeff(&thin);
        const Vec3 n = wall.rotation * Vec3::Unit(thin);
        for (const std::size_t i : dynamic_bodies(scene)) {
            const BodyDef& b = scene.bodies[i];
            const Real start = n.dot(b.position - wall.position), side = start < 0 ? -1 : 1;
            Real nearest = std::abs(start);
            for (const std::vector<BodyState>& s : history.states) nearest = std::min(nearest, side * n.dot(s[i].position - wall.position));
            const Real away = side * n.dot(history.states.back()[i].linear_velocity);
            const bool back = away > 0.01 * std::abs(n.dot(b.linear_velocity));
            if (nearest > half + holding_radius(b) + 0.1 && !back) return b.name + " did not come to the wall";
        }
        return {};
    }
    return {};
}

Real mechanical_energy(const Scene& scene, const std::vector<BodyState>& states) {
    Real sum = 0;
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        const Vec3 w = states[i].rotation.conjugate() * states[i].angular_velocity;
        sum +=
            b.mass * (states[i].linear_velocity.squaredNorm() / 2 - scene.gravity.dot(states[i].position)) + w.dot(body_inertia(b) * w) / 2;
    }
    return sum;
}

std::string board_turns(const Scene& scene, const History& history) {
    int balls = 0, stuck = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& b = scene.bodies[i];
        if (!b.motion) continue;
        for (std::size_t k = 0; k < history.t.size(); ++k) {
            const Real angle = b.motion->amplitude * std::sin(2 * kPi * history.t[k] / b.motion->period + b.motion->phase);
            const Quat wanted = Quat(Eigen::AngleAxis<Real>(angle, b.motion->axis.normalized())) * b.rotation;
            if (!(angle_between(wanted, history.states[k][i].rotation) <= 2e-3)) return b.name + " does not turn as it is told";
        }
        for (std::size_t j = 0; j < scene.bodies.size(); ++j) {
            if (!is_called(scene.bodies[j], "ball")) continue;
            Real way = 0;
            const auto on_board = [&](const std::vector<BodyState>& s) -> Vec3 {
                return s[i].rotation.conjugate() * (s[j].position - s[i].position);
            };
            const Vec3 first = on_board(history.states.front());
            for (const std::vector<BodyState>& s : history.states) way = std::max(way, (on_board(s) - first).head<2>().norm());
            ++balls;
            stuck += way < 0.1 ? 1 : 0;
        }
    }
    return stuck <= balls / 4 ? "" : fmt::format("{} of {} balls do not move on the board", stuck, balls);
}

// Chains are let go from level. At first the end is where that of the exact chain is, with its drop, and no energy has come or gone; later
// it passes the bottom and comes to the other side.
std::string chain_falls(const Scene& scene, const History& history) {
    constexpr std::size_t kMostJoints = 64;  // the reference's work grows with their cube
    const SceneJoint& first = scene.joints.front();
    if (first.body_a || !scene.joints.back().body_b || scene.joints.size() > kMostJoints) return {};
    const std::size_t end = *scene.joints.back().body_b;
    const Vec3 up = -scene.gravity.normalized(), arm = scene.bodies[end].position - first.def.anchor_a, side = arm.normalized();
    const Real length = arm.norm(), until = 0.5 * std::pow(length / 5, 0.25);  // before links that come from behind make it chaotic
    if (std::abs(side.dot(up)) > 1e-6) return {};
    std::vector<Real> times;
    for (const Real t : history.t) {
        if (t <= until + 1e-9) times.push_back(t);
    }
    if (times.size() < 2) return {};
    const std::vector<std::vector<BodyState>> truth = mechanism_reference(scene, times);
    const Real scale = scene.bodies[end].mass * scene.gravity.norm() * length, start = mechanical_energy(scene, truth.front());
    Real off = 0, lost = 0, gained = 0;
    for (std::size_t k = 0; k < times.size(); ++k) {
        const Real change = (mechanical_energy(scene, history.states[k]) - start) / scale;
        off = std::max(off, (history.states[k][end].position - truth[k][end].position).norm());
        lost = std::max(lost, -change);
        gained = std::max(gained, change);
    }
    const auto drop = [&](const std::vector<BodyState>& s) { return (scene.bodies[end].position - s[end].position).dot(up); };
    const Real share = drop(history.states[times.size() - 1]) / drop(truth.back());
    if (!(off <= 0.05 * length)) return fmt::format("its end is off by {:.2g} of its length at first", off / length);
    if (!(std::abs(share - 1) <= 0.08)) return fmt::format("its end has {:.0f} % of its drop", 100 * share);
    if (!(lost <= 0.05 && gained <= 0.01))
        return fmt::format("its energy changes at first: −{:.1f} %, +{:.1f} %", 100 * lost, 100 * gained);
    Real low = kInfinity, across = kInfinity;
    for (const std::vector<BodyState>& s : history.states) {
        low = std::min(low, (s[end].position - first.def.anchor_a).dot(up));
        across = std::min(across, (s[end].position - first.def.anchor_a).dot(side));
    }
    return low < -0.9 * length && across < -0.3 * length ? "" : "it does not swing through";
}

// What was dropped into a container (the static boxes) is still in it, slow, and lies on something.
std::string settles(const Scene& scene, const History& history) {
    const BodyDef* wall = nullptr;
    Vec3 low = Vec3::Constant(kInfinity), high = -low;
    for (const BodyDef& b : scene.bodies) {
        for (const Shape& s : b.shapes) {
            if (b.type != BodyType::kStatic || s.type != ShapeType::kBox) continue;
            if (wall == nullptr) wall = &b;
            const Pose X = Pose{b.rotation, b.position} * s.X_BS;
            const Mat3 R = (wall->rotation.conjugate() * X.q).toRotationMatrix();
            const Vec3 centre = wall->rotation.conjugate() * X.p, half = R.cwiseAbs() * s.half_extents;
            low = low.cwiseMin(centre - half);
            high = high.cwiseMax(centre + half);
        }
    }
    int out = 0, fast = 0, of = 0;
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyState& s = history.states.back()[i];
        ++of;
        fast += s.linear_velocity.norm() > kSlow ? 1 : 0;
        if (wall == nullptr) continue;
        const Vec3 x = wall->rotation.conjugate() * s.position;
        out += (x.head<2>().array() < low.head<2>().array()).any() || (x.head<2>().array() > high.head<2>().array()).any() ? 1 : 0;
    }
    if (out > 0) return fmt::format("{} left the container", out);
    if (10 * fast > of) return fmt::format("{} of {} have not settled", fast, of);
    const SupportCount lying = supported(scene, history, kSlow);
    if (lying.hovering > std::max(1, lying.of / 100)) return fmt::format("{} of {} slow bodies rest on nothing", lying.hovering, lying.of);
    return {};
}

struct NamedEvent {
    const char* scene;  // a name, or the beginning of names before a *
    std::string (*missing)(const Scene& scene, const History& history);
};
constexpr NamedEvent kEvents[] = {
    {"wall_*", bricks_move},
    {"ball_vs_stack", boxes_move},
    {"mostly_resting", balls_move},
    {"domino_*", dominoes_fall},
    {"mesh_slide", balls_do_not_hop},
    {"overlap", parts_at_the_end},
    {"tunnel", balls_reach_the_wall},
    {"maze*", board_turns},
    {"chain_*", chain_falls},
    {"hull_pile", settles},
    {"pile_*", settles},
    {"sphere_pile_*", settles},
    {"ragdolls_*", settles},
    {"hulls_*", settles},
    {"balls_*", settles},
};

}  // namespace

SupportCount supported(const Scene& scene, const History& history, Real slow) {
    SupportCount support;
    const std::size_t last = history.states.size() - 1, looks = slow <= kAtRest && last > 0 ? 2 : 1;
    std::vector<Real> gaps;
    for (const std::vector<std::size_t>& group : jointed_groups(scene).free) {
        Real radius = kInfinity, gap = kSupportReach;
        bool still = true, solid = false;
        for (const std::size_t i : group) {
            if (scene.bodies[i].shapes.empty()) continue;
            solid = true;
            radius = std::min(radius, holding_radius(scene.bodies[i]));
            for (std::size_t k = 0; k < looks; ++k) still = still && history.states[last - k][i].linear_velocity.norm() < slow;
        }
        if (!solid || !still) continue;
        if (gaps.empty()) gaps = support_gaps(scene, history.states[last]);
        for (const std::size_t i : group) gap = std::min(gap, gaps[i]);
        ++support.of;
        support.hovering += gap > std::min(0.02, radius / 2) ? 1 : 0;
    }
    return support;
}

std::string missing_event(const Scene& scene, const History& history) {
    const Flight flight = free_flight(scene, history);
    if (flight.off > flight.of / 100) return fmt::format("{} of {} do not fly freely before they touch anything", flight.off, flight.of);
    if (!scene.gravity.isZero(0)) {
        const SupportCount support = supported(scene, history, kAtRest);
        if (support.hovering > support.of / 100) return fmt::format("{} of {} at rest lie on nothing", support.hovering, support.of);
    }
    for (const NamedEvent& event : kEvents) {
        if (is_named(scene.name, event.scene)) return event.missing(scene, history);
    }
    return {};
}

}  // namespace cairn::cli
