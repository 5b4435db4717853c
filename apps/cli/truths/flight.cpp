#include "apps/cli/truths/flight.hpp"

#include "apps/cli/truth_parts.hpp"
#include "collision/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn::cli {

namespace {

constexpr Real kNever = std::numeric_limits<Real>::infinity();
constexpr Real kHorizon = 2;              // [s]
constexpr Real kMargin = 2e-3;            // [m]
constexpr Real kStep = 1.0 / 120;         // [s], between two looks at what does not move
constexpr std::size_t kMostUnits = 6000;  // the work grows with their square

struct Unit {
    std::vector<std::size_t> bodies;
    Real mass = 0, radius = 0;
    Vec3 p = Vec3::Zero(), v = Vec3::Zero();  // of the centre of mass at the start
    bool is_solid = false;
    Real touch = kNever;  // [s], the first time that something may have touched it
};

// What does not fall: a static shape, as a box in some frame or a half space.
struct Obstacle {
    bool is_plane = false;
    Mat3 R = Mat3::Identity();
    Vec3 centre = Vec3::Zero(), half = Vec3::Zero();  // of the box; a half space: its normal and, in half.x, its offset
    Real distance(const Vec3& x) const {
        if (is_plane) return centre.dot(x) - half.x();
        const Vec3 out = (R.transpose() * (x - centre)).cwiseAbs() - half;
        return out.cwiseMax(0).norm();
    }
};

Obstacle obstacle_of(const BodyDef& b, const Shape& s) {
    Obstacle o;
    const Pose X = Pose{b.rotation, b.position} * s.X_BS;
    o.centre = X.p;
    switch (s.type) {
        case ShapeType::kPlane:
            o.is_plane = true;
            o.centre = b.rotation * s.normal;
            o.half.x() = s.offset + o.centre.dot(b.position);
            break;
        case ShapeType::kBox:
            o.R = X.q.toRotationMatrix();
            o.half = s.half_extents;
            break;
        case ShapeType::kMesh: {
            Vec3 low = Vec3::Constant(kNever), high = -low;
            for (const Vec3& v : s.mesh->vertices()) {
                const Vec3 x = X.p + X.q * v;
                low = low.cwiseMin(x);
                high = high.cwiseMax(x);
            }
            o.centre = (low + high) / 2;
            o.half = (high - low) / 2;
            break;
        }
        default:
            o.centre = b.position;
            o.half = Vec3::Constant(holding_radius(b));
    }
    return o;
}

std::vector<Unit> units_of(const Scene& scene, const JointedGroups& groups) {
    std::vector<Unit> units;
    for (const std::vector<std::size_t>& group : groups.free) {
        Unit u;
        u.bodies = group;
        for (const std::size_t i : group) {
            const BodyDef& b = scene.bodies[i];
            u.mass += b.mass;
            u.p += b.mass * b.position;
            u.v += b.mass * b.linear_velocity;
            u.is_solid = u.is_solid || !b.shapes.empty();
            if (!b.force.isZero(0) || !b.torque.isZero(0)) u.touch = 0;
        }
        u.p /= u.mass;
        u.v /= u.mass;
        for (const std::size_t i : group)
            u.radius = std::max(u.radius, (scene.bodies[i].position - u.p).norm() + holding_radius(scene.bodies[i]));
        units.push_back(std::move(u));
    }
    return units;
}

// When two spheres that move apart or together in straight lines meet; under one gravity all do so.
Real meeting(const Unit& a, const Unit& b) {
    const Vec3 d = b.p - a.p, u = b.v - a.v;
    const Real reach = a.radius + b.radius + kMargin, gap = d.squaredNorm() - reach * reach, nearing = d.dot(u);
    if (gap <= 0) return 0;
    const Real root = nearing * nearing - u.squaredNorm() * gap;
    return nearing < 0 && root > 0 ? gap / (-nearing + std::sqrt(root)) : kNever;
}

Real meeting_obstacles(const Unit& u, const std::vector<Obstacle>& obstacles, const Vec3& g) {
    for (Real t = 0; t < kHorizon; t += kStep) {
        const Vec3 x = u.p + t * u.v + t * t / 2 * g;
        const Real room = u.radius + kMargin + (u.v + t * g).norm() * kStep + g.norm() * kStep * kStep;
        for (const Obstacle& o : obstacles) {
            if (o.distance(x) < room) return t;
        }
    }
    return kNever;
}

// Whatever may have been touched may touch others in turn: the earliest first.
void spread(std::vector<Unit>& units, const Vec3& g) {
    Real speed = 0;
    for (const Unit& u : units) speed = std::max(speed, u.v.norm());
    const Real pull = g.norm();
    std::vector<bool> done(units.size(), false);
    for (;;) {
        std::size_t first = SIZE_MAX;
        for (std::size_t k = 0; k < units.size(); ++k) {
            if (!done[k] && units[k].is_solid && units[k].touch < kHorizon && (first == SIZE_MAX || units[k].touch < units[first].touch))
                first = k;
        }
        if (first == SIZE_MAX) return;
        done[first] = true;
        const Unit& a = units[first];
        const Real t = a.touch;
        for (std::size_t k = 0; k < units.size(); ++k) {
            Unit& b = units[k];
            if (done[k] || !b.is_solid || b.touch <= t) continue;
            // Both fall alike until t. From then on the gap closes at three times the greatest speed V + g t at most, which takes
            // V t' + g t'² / 2 from what it is at t to a third of the gap more.
            const Real gap = std::max(0.0, (b.p - a.p + t * (b.v - a.v)).norm() - a.radius - b.radius - kMargin);
            const Real way = speed * t + pull * t * t / 2 + gap / 3;
            const Real then = pull > 0 ? (std::sqrt(speed * speed + 2 * pull * way) - speed) / pull : speed > 0 ? way / speed : kNever;
            b.touch = std::min(b.touch, std::max(t, then));
        }
    }
}

}  // namespace

Flight free_flight(const Scene& scene, const History& history) {
    Flight flight;
    const JointedGroups groups = jointed_groups(scene);
    std::vector<Unit> units = units_of(scene, groups);
    std::vector<Obstacle> obstacles;
    if (units.empty() || units.size() > kMostUnits) return flight;
    const std::size_t falling = units.size();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const BodyDef& b = scene.bodies[i];
        const bool turns = b.type == BodyType::kKinematic;
        if (turns && !b.linear_velocity.isZero(0)) return flight;
        if (turns) obstacles.push_back({false, Mat3::Identity(), b.position, Vec3::Constant(holding_radius(b))});
        for (const Shape& s : b.shapes) {
            if (b.type == BodyType::kStatic) obstacles.push_back(obstacle_of(b, s));
        }
        // What hangs may swing anywhere.
        if (groups.tied[i] && !b.shapes.empty()) units.push_back({{i}, b.mass, holding_radius(b), b.position, b.linear_velocity, true, 0});
    }
    for (std::size_t k = 0; k < falling; ++k) {
        Unit& u = units[k];
        if (!u.is_solid) continue;
        u.touch = std::min(u.touch, meeting_obstacles(u, obstacles, scene.gravity));
        for (std::size_t j = 0; j < k; ++j) {
            if (!units[j].is_solid) continue;
            const Real t = meeting(units[j], u);
            units[j].touch = std::min(units[j].touch, t);
            u.touch = std::min(u.touch, t);
        }
    }
    spread(units, scene.gravity);
    for (std::size_t n = 0; n < falling; ++n) {
        const Unit& u = units[n];
        bool off = false;
        for (std::size_t k = 0; k < history.t.size() && history.t[k] <= std::min(u.touch, kHorizon) + 1e-9; ++k) {
            const Real t = history.t[k];
            if (t < 1e-9) continue;
            Vec3 p = Vec3::Zero();
            for (const std::size_t i : u.bodies) p += scene.bodies[i].mass / u.mass * history.states[k][i].position;
            const Real error = (p - u.p - t * u.v - t * t / 2 * scene.gravity).norm();
            const Real g = scene.gravity.norm(), way = u.v.norm() * t + g * t * t / 2;
            off = off || !(error <= 0.01 * way + g * t / 60 + 1e-3);
            flight.worst = std::max(flight.worst, error);
        }
        ++flight.of;
        flight.off += off ? 1 : 0;
    }
    return flight;
}

}  // namespace cairn::cli
