// Joints alone, solved by RATTLE, through the world: closed forms, loops, mass ratios, energy, choice and refusal.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

// A rod of length l along x about `centre`, without shapes.
BodyDef rod(const Vec3& centre, Real l, Real mass) {
    BodyDef b;
    b.name = "rod";
    b.position = centre;
    b.mass = mass;
    b.inertia = Vec3(mass * l * l / 1200, mass * l * l / 12, mass * l * l / 12);
    return b;
}

// n rods of half a metre from the origin along x on ball joints, and a ball of mass `end` at the end.
BodyId hang_chain(World& world, int n, Real end) {
    BodyId last;
    for (int i = 0; i < n; ++i) {
        const BodyId id = world.add_body(rod({0.25 + 0.5 * i, 0, 0}, 0.5, 1));
        world.add_joint({JointType::kBall, last, id, {0.5 * i, 0, 0}});
        last = id;
    }
    BodyDef weight = rod({0.5 * n, 0, 0}, 0.4, end);
    weight.inertia = Vec3::Constant(0.4 * end * 0.04);
    const BodyId id = world.add_body(weight);
    world.add_joint({JointType::kBall, last, id, {0.5 * n, 0, 0}});
    return id;
}

Real energy(const World& world) {
    return world.kinetic_energy() + world.potential_energy();
}

WorldSettings forced(SolverChoice solver) {
    WorldSettings s;
    s.solver = solver;
    return s;
}

}  // namespace

TEST_CASE("a conical pendulum goes round at sqrt(g / (l cosθ)) on a rod and on a ball joint") {
    const JointType type = GENERATE(JointType::kBall, JointType::kDistance);
    CAPTURE(to_string(type));
    const Real l = 1.5, theta = 0.6, rate = std::sqrt(kG / (l * std::cos(theta)));
    World world;
    const Vec3 start(l * std::sin(theta), 0, -l * std::cos(theta));
    BodyDef bob = ball(0.1, start, 2);
    // On a ball joint the bob has no inertia of its own that counts: then both are the mathematical pendulum.
    if (type == JointType::kBall) bob.inertia = Vec3::Constant(1e-7);
    bob.linear_velocity = {0, rate * l * std::sin(theta), 0};
    if (type == JointType::kBall) bob.angular_velocity = {0, 0, rate};
    const BodyId id = world.add_body(bob);
    world.add_joint({type, id, BodyId{}, type == JointType::kBall ? Vec3(Vec3::Zero()) : start, Vec3::Zero()});
    run(world, 5);
    const Real angle = rate * world.time();
    const Vec3 truth(start.x() * std::cos(angle), start.x() * std::sin(angle), start.z());
    // Suzuki's fourth order at hω = 0.05: (hω)⁴ / 1000 of 14 rad.
    CHECK((world.state(id).position - truth).norm() < 1e-6);
}

TEST_CASE("a bob almost without inertia of its own, on an arm, neither flies off nor stretches it") {
    // The rows of its joint differ by ‖r‖² m / I in weight, up to 5e9: what the factor may drop as redundant is not.
    const Real inertia = GENERATE(1e-6, 1e-9);
    CAPTURE(inertia);
    World world;
    BodyDef bob = ball(0.1, {1.5, 0, 0}, 2);
    bob.inertia = Vec3::Constant(inertia);
    const BodyId id = world.add_body(bob);
    world.add_joint({JointType::kBall, id, BodyId{}, Vec3::Zero()});
    run(world, 2, kStep, [&](const StepReport& r) {
        REQUIRE(r.ok);
        REQUIRE(std::abs(world.state(id).position.norm() - 1.5) < 1e-3);
    });
}

TEST_CASE("a steady top precesses at the rate of its closed form") {
    // Upright disc on a ball joint, tilted: Ω solves I₁ Ω² cosθ − I₃ s Ω + m g l = 0 with spin s about its axis (slow root).
    const Real m = 1, r = 0.5, d = 0.6, theta = 0.5, spin = 60;
    const Real along = m * r * r / 2, across = m * r * r / 4 + m * d * d;
    const Real a = across * std::cos(theta), b = along * spin;
    const Real precession = (b - std::sqrt(b * b - 4 * a * m * kG * d)) / (2 * a);
    World world;
    BodyDef disc;
    disc.name = "disc";
    disc.mass = m;
    disc.inertia = Vec3(m * r * r / 4, m * r * r / 4, along);
    disc.rotation = turn(Vec3::UnitY(), theta);
    const Vec3 axis = disc.rotation * Vec3::UnitZ();
    disc.position = d * axis;
    // ω = Ω e_z + φ̇ axis with spin = φ̇ + Ω cosθ.
    disc.angular_velocity = precession * Vec3::UnitZ() + (spin - precession * std::cos(theta)) * axis;
    disc.linear_velocity = disc.angular_velocity.cross(disc.position);
    const BodyId id = world.add_body(disc);
    world.add_joint({JointType::kBall, id, BodyId{}, Vec3::Zero()});
    run(world, 3);
    const Real angle = precession * world.time();
    const Vec3 truth = turn(Vec3::UnitZ(), angle) * disc.position;
    // hω = 1 for the spin; nutation, with h I₃ s / I₁ = 0.3, is started by 4th-order errors (0.3)⁴ / 100 of d at most.
    CHECK((world.state(id).position - truth).norm() < 1e-4);
}

TEST_CASE("islands of joints alone go to RATTLE by themselves, and energy stays") {
    // Three rods with a light end whip: a step admits 1e-3 of the kinetic energy (which is under the scale), of a few whips in five
    // seconds. Under a heavy end the rods' own modes are only kept stable, by 2nd order: (Ω h)² / 24 = 2 % of their energy, which is less
    // than a tenth of the scale.
    const Real end = GENERATE(1.0, 100.0), most = end < 10 ? 5e-3 : 2e-3;
    CAPTURE(end);
    World world;
    hang_chain(world, end < 10 ? 3 : 10, end);
    const Real E = energy(world), scale = (end < 10 ? (end + 1.5) * 1.5 : end * 5) * kG;
    Real worst = 0;
    run(world, 5, kStep, [&](const StepReport& r) {
        REQUIRE(r.islands_of[static_cast<int>(SolverChoice::kRattle)] == 1);
        worst = std::max(worst, std::abs(energy(world) - E));
    });
    CHECK(worst < most * scale);
}

TEST_CASE("a chain under a thousand links' weight stretches by less than a part in a million") {
    World world;
    const BodyId end = hang_chain(world, 30, 1000);
    run(world, 1.5, kStep, [&](const StepReport& r) {
        REQUIRE(r.islands_of[static_cast<int>(SolverChoice::kRattle)] == 1);
        REQUIRE(world.state(end).position.norm() < 15 * (1 + 1e-6));
    });
    for (std::size_t k = 0; k < world.joint_count(); ++k) CHECK(world.joint_error({static_cast<std::uint32_t>(k), 0}).position < 1e-6 * 15);
}

TEST_CASE("a parallelogram of four hinges swings as a pendulum of its bars and keeps its energy") {
    // Two legs of length l on the world's hinges carry a bar: redundant in space. All turn alike, so the bar only moves along a circle:
    // (2 m_leg l²/3 + m_bar l²) θ̈ = −(m_leg + m_bar) g l sin θ.
    const Real l = 0.8, theta = 1;
    World world;
    const Vec3 down(std::sin(theta), 0, -std::cos(theta)), right(1, 0, 0);
    const auto leg = [&](const Vec3& top) {
        BodyDef b = rod(top + l / 2 * down, l, 1);
        b.rotation = Quat(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), down));
        return world.add_body(b);
    };
    const BodyId left_leg = leg({0, 0, 0}), right_leg = leg(right), bar = world.add_body(rod(l * down + right / 2, 1, 2));
    const Vec3 y = Vec3::UnitY();
    world.add_joint({JointType::kHinge, BodyId{}, left_leg, {0, 0, 0}, {}, y});
    world.add_joint({JointType::kHinge, BodyId{}, right_leg, right, {}, y});
    world.add_joint({JointType::kHinge, left_leg, bar, l * down, {}, y});
    world.add_joint({JointType::kHinge, right_leg, bar, right + l * down, {}, y});
    const Real E = energy(world), inertia = 2 * l * l / 3 + 2 * l * l, weight = 3 * kG * l;
    Real angle = theta, rate = 0;
    run(world, 4, kStep, [&](const StepReport& r) {
        REQUIRE(r.islands_of[static_cast<int>(SolverChoice::kRattle)] == 1);
        constexpr int n = 200;  // the closed form's equation by the leap-frog in small steps: (ω h)² / 24 = 4e-9
        const Real h = kStep / n;
        for (int k = 0; k < n; ++k) {
            rate -= h / 2 * weight / inertia * std::sin(angle);
            angle += h * rate;
            rate -= h / 2 * weight / inertia * std::sin(angle);
        }
        const Vec3 truth = l * Vec3(std::sin(angle), 0, -std::cos(angle)) + right / 2;
        REQUIRE((world.state(bar).position - truth).norm() < 1e-5);
    });
    CHECK(std::abs(energy(world) - E) < 1e-5 * weight);
}

TEST_CASE("a rod hinged to a driven body follows it") {
    // A kinematic body turns at a constant rate about z and carries a fixed body at its rim.
    WorldSettings s = no_gravity();
    World world(s);
    BodyDef wheel;
    wheel.name = "wheel";
    wheel.type = BodyType::kKinematic;
    wheel.angular_velocity = {0, 0, 3};
    const BodyId w = world.add_body(wheel);
    BodyDef b = rod({1, 0, 0}, 0.5, 1);
    b.linear_velocity = {0, 3, 0};
    b.angular_velocity = {0, 0, 3};
    const BodyId id = world.add_body(b);
    world.add_joint({JointType::kFixed, w, id, {0.7, 0, 0}});
    run(world, 2, kStep, [&](const StepReport& r) { REQUIRE(r.islands_of[static_cast<int>(SolverChoice::kRattle)] == 1); });
    const Real angle = 3 * world.time();
    CHECK((world.state(id).position - Vec3(std::cos(angle), std::sin(angle), 0)).norm() < 1e-7);
}

TEST_CASE("RATTLE forced on an island with contacts leaves it and says which") {
    World world(forced(SolverChoice::kRattle));
    world.add_body(ground());
    const BodyId box = world.add_body(cube(1, {0, 0, 0.5}));
    const StepReport r = world.step(kStep);
    CHECK_FALSE(r.ok);
    CHECK(r.islands_refused == 1);
    CHECK(r.refused_body == box.index);
    CHECK(world.state(box).position.z() == 0.5);
}
