// Torsional and rolling friction.
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {
constexpr Real kRadius = 0.3, kMass = 2, kMoment = 0.4 * kMass * kRadius * kRadius;

WorldSettings textbook() {
    WorldSettings s;
    s.stabilisation = Stabilisation::kTargetVelocity;
    return s;
}
}  // namespace

TEST_CASE("rolling friction slows a rolling ball by 5/7 g c / r, whatever its direction") {
    const Real heading = GENERATE(0.0, 0.4, 2.0), c = 0.004, v = 1;
    const bool by_textbook = GENERATE(false, true);
    CAPTURE(heading, by_textbook);
    World world(by_textbook ? textbook() : WorldSettings());
    world.add_body(ground(0.6));
    BodyDef def = ball(kRadius, {0, 0, kRadius}, kMass, 0.6);
    const Vec3 along(std::cos(heading), std::sin(heading), 0);
    def.linear_velocity = v * along;
    def.angular_velocity = v / kRadius * Vec3::UnitZ().cross(along);
    def.rolling_friction = c;
    const BodyId id = world.add_body(def);
    // About the line of contact only the moment c m g acts: (I + m r²) α = −c m g.
    const Real a = c * kMass * kG * kRadius / (kMoment + kMass * kRadius * kRadius), t = 2;
    run(world, t);
    const BodyState s = world.state(id);
    // The default's first step starts without the moment; the textbook's positions are of first order, a t h / 2.
    const Real h = kStep / WorldSettings().substeps;
    CHECK((s.linear_velocity - (v - a * t) * along).norm() < a * h);
    CHECK((s.position - def.position - (v * t - a * t * t / 2) * along).norm() < (by_textbook ? 2 : 1) * a * h * t);
}

TEST_CASE("a ball with rolling friction stops after 7 v² r / 10 g c and stays") {
    const Real c = 0.01, v = 1;
    World world;
    world.add_body(ground(0.6));
    BodyDef def = ball(kRadius, {0, 0, kRadius}, kMass, 0.6);
    def.linear_velocity = {v, 0, 0};
    def.angular_velocity = {0, v / kRadius, 0};
    def.rolling_friction = c;
    const BodyId id = world.add_body(def);
    run(world, 8);  // stops after 7 v r / 5 g c = 4.3 s
    const Real way = 7 * v * v * kRadius / (10 * kG * c);
    const BodyState stopped = world.state(id);
    CHECK(std::abs(stopped.position.x() / way - 1) < 1e-3);
    run(world, 2);
    CHECK((world.state(id).position - stopped.position).norm() < 1e-9);
    CHECK(world.state(id).angular_velocity.norm() < 1e-9);
}

TEST_CASE("torsional friction stops a spinning ball after I ω / c m g") {
    const Real c = 0.02, w = 5;
    World world;
    world.add_body(ground(0.5));
    BodyDef def = ball(kRadius, {0, 0, kRadius}, kMass);
    def.angular_velocity = {0, 0, w};
    def.torsional_friction = c;
    const BodyId id = world.add_body(def);
    const Real rate = c * kMass * kG / kMoment;
    run(world, 0.5);
    const Real h = kStep / WorldSettings().substeps;
    CHECK(std::abs(world.state(id).angular_velocity.z() - (w - rate * 0.5)) < rate * h);
    run(world, 1);  // it stops after w / rate = 0.92 s
    CHECK(world.state(id).angular_velocity.norm() < 1e-9);
    CHECK((world.state(id).position - def.position).norm() < 1e-9);
}

TEST_CASE("a ball on a slope rolls where tan θ > c / r, and is held below") {
    const Real c = 0.06, angle = std::atan(c / kRadius);
    const Real share = GENERATE(0.9, 1.5);
    const Real theta = share * angle;
    CAPTURE(theta);
    const Vec3 n(std::sin(theta), 0, std::cos(theta)), down(std::cos(theta), 0, -std::sin(theta));
    World world;
    world.add_body(fixed(Shape::plane(n, 0), Vec3::Zero(), 0.8));
    BodyDef def = ball(kRadius, kRadius * n, kMass, 0.8);
    def.rolling_friction = c;
    const BodyId id = world.add_body(def);
    const Real t = 2;
    run(world, t);
    const Real a = std::max(0.0, 5.0 / 7 * kG * (std::sin(theta) - c / kRadius * std::cos(theta)));
    const Real way = (world.state(id).position - def.position).dot(down);
    CHECK(std::abs(way - a * t * t / 2) < 2e-3 * kG * std::sin(theta) * kStep * t + (share < 1 ? 0 : 1e-3 * a * t * t));
}

TEST_CASE("what torsional friction takes from a spinning ball is told as work of friction") {
    WorldSettings settings;
    settings.diagnostics = true;
    World world(settings);
    world.add_body(ground(0.5));
    BodyDef def = ball(kRadius, {0, 0, kRadius}, kMass);
    def.angular_velocity = {0, 0, 5};
    def.torsional_friction = 0.02;
    const BodyId id = world.add_body(def);
    const StepReport& report = world.step(kStep);
    REQUIRE(report.diagnostics != nullptr);
    const Real w = world.state(id).angular_velocity.z(), lost = 0.5 * kMoment * (25 - w * w);
    CHECK(lost > 0.03);
    CHECK(std::abs(report.diagnostics->energy.friction + lost) < 1e-12);
    CHECK(report.diagnostics->islands.at(0).reason == SolverReason::kSpinFriction);
    CHECK(report.diagnostics->residual.max < 1e-12);
}

TEST_CASE("the larger coefficient of a pair counts") {
    const bool on_ground = GENERATE(true, false);
    World world;
    BodyDef plane = ground(0.5);
    BodyDef def = ball(kRadius, {0, 0, kRadius}, kMass);
    (on_ground ? plane : def).torsional_friction = 0.02;
    def.angular_velocity = {0, 0, 5};
    world.add_body(plane);
    const BodyId id = world.add_body(def);
    run(world, 2);
    CHECK(world.state(id).angular_velocity.norm() < 1e-9);
}

TEST_CASE("without friction there is no rolling friction, and the direct solver refuses what has some") {
    WorldSettings settings;
    settings.model.friction = FrictionModel::kNone;
    BodyDef def = ball(kRadius, {0, 0, kRadius}, kMass);
    def.angular_velocity = {0, 0, 5};
    def.torsional_friction = 0.02;
    World frictionless(settings);
    frictionless.add_body(ground());
    const BodyId id = frictionless.add_body(def);
    run(frictionless, 1);
    CHECK(std::abs(frictionless.state(id).angular_velocity.z() - 5) < 1e-12);
    WorldSettings direct;
    direct.solver = SolverChoice::kDirect;
    World refusing(direct);
    refusing.add_body(ground());
    refusing.add_body(def);
    CHECK(refusing.step(kStep).islands_refused == 1);
}
