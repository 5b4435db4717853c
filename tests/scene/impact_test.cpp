// Two spheres that meet obliquely, against the textbook's impact: Newton's restitution along the normal at the time they meet, Coulomb's
// friction across it.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

struct Ball {
    Real radius, mass;
    Vec3 x, v, w;
    Real moment() const { return 0.4 * mass * radius * radius; }
};

// The first time at which two balls in free flight touch [s].
Real meeting_time(const Ball& a, const Ball& b) {
    const Vec3 d = a.x - b.x, u = a.v - b.v;
    const Real reach = a.radius + b.radius, half = d.dot(u);
    return (d.squaredNorm() - reach * reach) / (std::sqrt(half * half - u.squaredNorm() * (d.squaredNorm() - reach * reach)) - half);
}

// Velocities after the impact. For a sphere S_T = 1/m_A + 1/m_B + r_A²/I_A + r_B²/I_B in every direction across n.
void collide(Ball& a, Ball& b, Real t, Real restitution, Real mu) {
    const Vec3 n = (a.x + t * a.v - b.x - t * b.v).normalized();
    const Vec3 u = a.v - a.w.cross(a.radius * n) - b.v - b.w.cross(b.radius * n);
    const Real un = n.dot(u), masses = 1 / a.mass + 1 / b.mass;
    const Vec3 slip = u - un * n;
    const Real lambda = -(1 + restitution) * un / masses;
    const Real across = masses + a.radius * a.radius / a.moment() + b.radius * b.radius / b.moment();
    const Real alpha = std::min(slip.norm() / across, mu * lambda);
    const Vec3 impulse = lambda * n - alpha * slip.normalized();
    a.v += impulse / a.mass;
    b.v -= impulse / b.mass;
    a.w += (-a.radius * n).cross(impulse) / a.moment();
    b.w -= (b.radius * n).cross(impulse) / b.moment();
}

BodyDef def(const Ball& ball, Real restitution, Real mu) {
    BodyDef d = world_building::ball(ball.radius, ball.x, ball.mass, mu);
    d.restitution = restitution;
    d.linear_velocity = ball.v;
    d.angular_velocity = ball.w;
    return d;
}

}  // namespace

TEST_CASE("spheres that meet obliquely part as Newton and Coulomb say, wherever in the step they meet") {
    struct Case {
        Real restitution, mu;
        Vec3 spin;
    };
    const Case c = GENERATE(Case{1, 0, {0, 0, 0}}, Case{0.5, 0.1, {0, 0, 0}}, Case{0.3, 0.9, {0, 0, 0}}, Case{0.3, 0.8, {3, -9, 4}});
    const Real offset = GENERATE(0.0, 0.13, 0.31, 0.5, 0.77, 0.98);  // of a step
    Ball a{0.5, 1, {-1, 0.6, 0.1}, {4, -0.3, 0}, c.spin}, b{0.4, 2, {0.2, 0.1, 0}, {0, 0, 0}, {0, 0, 0}};
    a.x -= offset * kStep * a.v;
    World world(no_gravity());
    const BodyId id_a = world.add_body(def(a, c.restitution, c.mu)), id_b = world.add_body(def(b, c.restitution, c.mu));
    collide(a, b, meeting_time(a, b), c.restitution, c.mu);
    for (int k = 0; k < 30; ++k) world.step(kStep);
    const BodyState after_a = world.state(id_a), after_b = world.state(id_b);
    CAPTURE(c.mu, offset, (after_a.linear_velocity - a.v).norm(), (after_b.linear_velocity - b.v).norm());
    CAPTURE(a.radius * (after_a.angular_velocity - a.w).norm(), b.radius * (after_b.angular_velocity - b.w).norm());
    // Impulses of 5 N s by one solve of three rows that do not disturb one another: rounding.
    const Real bound = 1e-9;
    CHECK((after_a.linear_velocity - a.v).norm() < bound);
    CHECK((after_b.linear_velocity - b.v).norm() < bound);
    CHECK(a.radius * (after_a.angular_velocity - a.w).norm() < bound);
    CHECK(b.radius * (after_b.angular_velocity - b.w).norm() < bound);
}

TEST_CASE("a ball that bounces on another one stays over it: the normal is the one of the impact") {
    World world;
    BodyDef fixed_ball = fixed(Shape::sphere(0.5), {0, 0, 0}, 0);
    fixed_ball.restitution = 1;
    world.add_body(fixed_ball);
    BodyDef d = ball(0.2, {0, 0, 1.2}, 1, 0);
    d.restitution = 1;
    const BodyId id = world.add_body(d);
    const Real energy = kG * 1.2;
    for (int k = 0; k < 120; ++k) {
        world.step(kStep);
        const BodyState s = world.state(id);
        REQUIRE(s.position.head<2>().norm() < 1e-12);
        REQUIRE(kG * s.position.z() + 0.5 * s.linear_velocity.squaredNorm() == Approx(energy).epsilon(1e-9));
    }
}
