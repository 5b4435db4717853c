// Balls that hit one another in free space: every impact in order, each with Newton's restitution and Coulomb's friction.
#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn::cli {

namespace {

struct Ball {
    Vec3 p, v, w;
    Real radius = 0, mass = 1, inertia = 1, friction = 0, restitution = 0;
};

std::vector<Ball> balls_of(const Scene& scene) {
    std::vector<Ball> balls;
    for (const std::size_t i : dynamic_bodies(scene)) {
        const BodyDef& b = scene.bodies[i];
        balls.push_back({b.position, b.linear_velocity, b.angular_velocity, b.shapes.at(0).radius, b.mass, body_inertia(b)(0, 0),
                         b.friction, b.restitution});
    }
    return balls;
}

// When two balls touch, from now on; infinite if they never do.
Real time_of_impact(const Ball& a, const Ball& b) {
    const Vec3 d = b.p - a.p, u = b.v - a.v;
    const Real reach = a.radius + b.radius, speed2 = u.squaredNorm(), nearing = d.dot(u), gap = d.squaredNorm() - reach * reach;
    const Real root = nearing * nearing - speed2 * gap;
    if (nearing >= -1e-13 || root <= 0) return std::numeric_limits<Real>::infinity();
    return std::max(gap, 0.0) / (-nearing + std::sqrt(root));
}

// Impulse J on b, −J on a: its normal part turns the normal speed u_n into −e u_n; friction takes the slip away, or as much as μ lets it.
void collide(Ball& a, Ball& b) {
    const Vec3 n = (b.p - a.p).normalized(), r_a = a.radius * n, r_b = -b.radius * n;
    const Vec3 u = b.v + b.w.cross(r_b) - a.v - a.w.cross(r_a);
    const Real u_n = u.dot(n), by_mass = 1 / a.mass + 1 / b.mass;
    const Vec3 slip = u - u_n * n;
    const Real normal = -(1 + std::max(a.restitution, b.restitution)) * u_n / by_mass;
    Vec3 J = normal * n;
    if (slip.norm() > 1e-14) {
        const Real stops = slip.norm() / (by_mass + a.radius * a.radius / a.inertia + b.radius * b.radius / b.inertia);
        J -= std::min(std::sqrt(a.friction * b.friction) * normal, stops) * slip.normalized();
    }
    a.v -= J / a.mass;
    a.w -= r_a.cross(J) / a.inertia;
    b.v += J / b.mass;
    b.w += r_b.cross(J) / b.inertia;
}

void play(std::vector<Ball>& balls, Real until) {
    for (Real now = 0;;) {
        Real first = std::numeric_limits<Real>::infinity();
        std::pair<std::size_t, std::size_t> who;
        for (std::size_t i = 0; i < balls.size(); ++i) {
            for (std::size_t j = i + 1; j < balls.size(); ++j) {
                const Real t = time_of_impact(balls[i], balls[j]);
                if (t < first) {
                    first = t;
                    who = {i, j};
                }
            }
        }
        if (now + first >= until) return;
        for (Ball& b : balls) b.p += first * b.v;
        now += first;
        collide(balls[who.first], balls[who.second]);
    }
}

TruthError impact_error(const Scene& scene, const History& history, bool with_spin) {
    std::vector<Ball> balls = balls_of(scene);
    Real fastest = 0;
    for (const Ball& b : balls) fastest = std::max(fastest, b.v.norm());
    play(balls, history.t.back());
    TruthError error{0, "1", with_spin ? "final velocity and spin" : "final velocity", ""};
    const std::vector<std::size_t> index = dynamic_bodies(scene);
    for (std::size_t k = 0; k < balls.size(); ++k) {
        const BodyState& s = history.states.back()[index[k]];
        error.value = std::max(error.value, (s.linear_velocity - balls[k].v).norm() / fastest);
        if (with_spin) error.value = std::max(error.value, (s.angular_velocity - balls[k].w).norm() * balls[k].radius / fastest);
    }
    return error;
}

}  // namespace

// Worst final velocity, relative to the fastest start.
TruthError impact_velocity(const Scene& scene, const History& history) {
    return impact_error(scene, history, false);
}

// The same, and spin times radius.
TruthError impact_velocity_and_spin(const Scene& scene, const History& history) {
    return impact_error(scene, history, true);
}

}  // namespace cairn::cli
