// Joints with contacts, solved together, through the world: closed forms, rest, mass ratios, loops, piles, choice and refusal.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

// A capsule of straight length l along x about `centre`, with the inertia of a rod.
BodyDef link(const Vec3& centre, Real l, Real mass, Real radius = 0.05) {
    BodyDef b = body(Shape::capsule(radius, l / 2), centre, mass, 0.6);
    b.rotation = turn(Vec3::UnitY(), kPi / 2);
    b.inertia = Vec3(mass * l * l / 12, mass * l * l / 12, mass * radius * radius / 2);
    return b;
}

bool is_mixed(const StepReport& r) {
    return r.islands_of[static_cast<int>(SolverChoice::kMixed)] > 0;
}

Real worst_joint(const World& world) {
    Real worst = 0;
    for (std::size_t k = 0; k < world.joint_count(); ++k)
        worst = std::max(worst, world.joint_error({static_cast<std::uint32_t>(k), 0}).position);
    return worst;
}

// A figure of a trunk and four limbs of two parts each.
void add_figure(World& world, const Vec3& at, const Quat& q) {
    const auto part = [&](const Shape& shape, const Vec3& x, Real mass, const Quat& own = Quat::Identity()) {
        BodyDef b = body(shape, at + q * x, mass, 0.6);
        b.rotation = q * own;
        return world.add_body(b);
    };
    const BodyId trunk = part(Shape::box({0.12, 0.2, 0.3}), {0, 0, 0}, 50);
    const Quat level = turn(Vec3::UnitX(), kPi / 2);
    for (Real side : {-1.0, 1.0}) {
        const BodyId arm = part(Shape::capsule(0.06, 0.11), {0, side * 0.42, 0.22}, 3, level);
        const BodyId hand = part(Shape::capsule(0.05, 0.11), {0, side * 0.78, 0.22}, 2, level);
        const BodyId leg = part(Shape::capsule(0.08, 0.12), {0, side * 0.11, -0.52}, 6);
        const BodyId foot = part(Shape::capsule(0.07, 0.13), {0, side * 0.11, -0.97}, 5);
        world.add_joint({JointType::kBall, trunk, arm, at + q * Vec3(0, side * 0.22, 0.22)});
        world.add_joint({JointType::kHinge, arm, hand, at + q * Vec3(0, side * 0.6, 0.22), {}, q * Vec3::UnitZ()});
        world.add_joint({JointType::kBall, trunk, leg, at + q * Vec3(0, side * 0.11, -0.3)});
        world.add_joint({JointType::kHinge, leg, foot, at + q * Vec3(0, side * 0.11, -0.745), {}, q * Vec3::UnitY()});
    }
}

}  // namespace

TEST_CASE("a ball that hits the end of two hinged rods meets two sevenths of a rod's mass") {
    // Closed form: with P at the end, the hinge gives P/4 and the end moves with (1 + 1/4 + 3 (1 − 1/4)) P/m = 7/2 P/m.
    const Real mass = 3, l = 1, ball_mass = 2, speed = 1;
    World world(no_gravity());
    const BodyId rod1 = world.add_body(link({0, 0, 0}, l, mass)), rod2 = world.add_body(link({l, 0, 0}, l, mass));
    world.add_joint({JointType::kBall, rod1, rod2, {l / 2, 0, 0}});
    BodyDef b = ball(0.1, {-l / 2, 0, 0.15 + 0.004}, ball_mass);
    b.linear_velocity = {0, 0, -speed};
    const BodyId hitting = world.add_body(b);
    const StepReport r = world.step(kStep);
    REQUIRE(is_mixed(r));
    // The end turns by 0.03 rad within the step, and cos of it is what the normal has lost.
    CHECK(world.state(hitting).linear_velocity.z() == Approx(-speed * ball_mass / (ball_mass + 2 * mass / 7)).epsilon(2e-3));
    CHECK(worst_joint(world) < 1e-5);
}

TEST_CASE("a chain that lies on the ground stays, its joints closed, the ground bearing its weight") {
    const int n = GENERATE(12, 40);  // of 40 too many touch the ground for contact rows in the space of the joints
    CAPTURE(n);
    World world;
    world.add_body(ground());
    std::vector<BodyId> links;
    for (int k = 0; k < n; ++k) {
        links.push_back(world.add_body(link({0.5 * k, 0, 0.05}, 0.4, 1)));
        if (k > 0) world.add_joint({JointType::kBall, links[k - 1], links[k], {0.5 * k - 0.25, 0, 0.05}});
    }
    run(world, 3, kStep, [&](const StepReport& r) { REQUIRE(is_mixed(r)); });
    for (int k = 0; k < n; ++k) CHECK((world.state(links[k]).position - Vec3(0.5 * k, 0, 0.05)).norm() < 1e-5);
    CHECK(worst_joint(world) < 1e-6);
    CHECK(ground_impulse(world) / kStep == Approx(n * kG).epsilon(1e-3));
}

TEST_CASE("boxes on a joint rest on a slope below the friction angle without creeping") {
    const JointType type = GENERATE(JointType::kBall, JointType::kHinge, JointType::kFixed);
    CAPTURE(to_string(type));
    const Real angle = 0.4;  // tan 0.4 = 0.42 < 0.6
    const Quat q = turn(Vec3::UnitY(), angle);
    World world;
    world.add_body(fixed(Shape::plane(q * Vec3::UnitZ(), 0), Vec3::Zero(), 0.6));
    const auto box = [&](Real x) {
        BodyDef b = cube(0.5, q * Vec3(x, 0, 0.25), 2, 0.6);
        b.rotation = q;
        return world.add_body(b);
    };
    const BodyId a = box(-0.3), b = box(0.3);
    world.add_joint({type, a, b, q * Vec3(0, 0, 0.25), {}, q * Vec3::UnitY()});
    run(world, 1, kStep, [&](const StepReport& r) { REQUIRE(is_mixed(r)); });
    const Vec3 start = world.state(a).position;
    run(world, 4);
    // The load settles in the first second; a creep of 1e-6 m/s would show.
    CHECK((world.state(a).position - start).norm() < 4e-6);
    CHECK(worst_joint(world) < 1e-5 * 0.45);  // the solver's tolerance: 1e-5 of the arm
}

TEST_CASE("figures that fall on each other on a slope keep their joints to a tenth of a millimetre") {
    World world;
    world.add_body(fixed(Shape::plane(turn(Vec3::UnitX(), 0.2) * Vec3::UnitZ(), 0), Vec3::Zero(), 0.6));
    add_figure(world, {0, 0, 1.2}, turn({1, 1, 0}, 1.2));
    add_figure(world, {0.1, 0.1, 2.2}, turn({1, -1, 0.3}, 1.4));
    add_figure(world, {-0.1, 0, 3.2}, turn({0, 1, 0.5}, 1.0));
    const Real E = world.kinetic_energy() + world.potential_energy();
    int mixed = 0;
    Real worst = 0;
    run(world, 3, kStep, [&](const StepReport& r) {
        REQUIRE(r.ok);
        mixed += is_mixed(r);
        worst = std::max(worst, worst_joint(world));
        REQUIRE(world.kinetic_energy() + world.potential_energy() < E + 1e-6 * E);
    });
    CHECK(mixed > 100);
    CHECK(worst < 1e-4);
}

TEST_CASE("a chain taut under a thousand links' weight that balls hit stretches by less than a part in a hundred thousand") {
    const int n = 60;
    World world;
    BodyId last;
    for (int k = 0; k < n; ++k) {
        BodyDef b = link({0, 0, -0.25 - 0.5 * k}, 0.4, 1);
        b.rotation = Quat::Identity();
        const BodyId id = world.add_body(b);
        world.add_joint({JointType::kBall, last, id, {0, 0, -0.5 * k}});
        last = id;
    }
    const BodyId end = world.add_body(ball(0.4, {0, 0, -0.5 * n - 0.5}, 1000));
    world.add_joint({JointType::kBall, last, end, {0, 0, -0.5 * n}});
    for (int k = 0; k < 3; ++k) {
        BodyDef thrown = ball(0.2, {0.5, 0, -8.25 - 5 * k}, 5);
        thrown.linear_velocity = {-4, 0, 1};
        world.add_body(thrown);
    }
    int mixed = 0;
    run(world, 1, kStep, [&](const StepReport& r) {
        mixed += is_mixed(r);
        REQUIRE(r.ok);
        REQUIRE(r.islands_of[static_cast<int>(SolverChoice::kSi)] == 0);
        // SHAKE's tolerance is 1e-5 of the ball's arm of 0.5 m a joint; of them all and with all of one sign 1e-5 of the length.
        REQUIRE(worst_joint(world) < 1e-5 * 0.5);
        REQUIRE(world.state(end).position.norm() < (1 + 1e-5) * (0.5 * n + 0.5));
    });
    CHECK(mixed > 5);
}

TEST_CASE("a ring of bars on hinges that falls flat stays a ring") {
    // Four hinges in a plane: redundant, and one loop more than a tree has.
    World world;
    world.add_body(ground());
    const Real l = 1;
    std::vector<BodyId> bars;
    for (int k = 0; k < 4; ++k) {
        const Quat q = turn(Vec3::UnitZ(), k * kPi / 2);
        BodyDef b = body(Shape::box({0.4, 0.05, 0.05}), q * Vec3(0, -l / 2, 0) + Vec3(0, 0, 0.3), 1, 0.6);
        b.rotation = q;
        bars.push_back(world.add_body(b));
    }
    for (int k = 0; k < 4; ++k) {
        const Vec3 corner = turn(Vec3::UnitZ(), k * kPi / 2) * Vec3(l / 2, -l / 2, 0) + Vec3(0, 0, 0.3);
        world.add_joint({JointType::kHinge, bars[k], bars[(k + 1) % 4], corner, {}, Vec3::UnitZ()});
    }
    int mixed = 0;
    run(world, 2, kStep, [&](const StepReport& r) {
        mixed += is_mixed(r);
        REQUIRE(r.ok);
        REQUIRE(worst_joint(world) < 1e-4);
    });
    CHECK(mixed > 60);
    for (const BodyId& bar : bars) {
        CHECK(world.state(bar).position.z() == Approx(0.05).margin(1e-4));
        CHECK(world.state(bar).linear_velocity.norm() < 1e-4);
    }
}

TEST_CASE("the mixed solver forced on joints alone leaves the island and says which") {
    WorldSettings s;
    s.solver = SolverChoice::kMixed;
    World world(s);
    const BodyId bob = world.add_body(link({1, 0, 0}, 0.5, 1));
    world.add_joint({JointType::kBall, bob, BodyId{}, Vec3::Zero()});
    const StepReport r = world.step(kStep);
    CHECK_FALSE(r.ok);
    CHECK(r.islands_refused == 1);
    CHECK(r.refused_body == bob.index);
}

TEST_CASE("a chain of two hundred links that falls on a table under a thousand links' weight stretches by less than a part in a thousand") {
    constexpr int kLinks = 200;
    constexpr Real kLength = 0.1, kWhole = kLinks * kLength;
    World world;
    world.add_body(fixed(Shape::plane(Vec3::UnitZ(), -kWhole / 4)));
    BodyId last;
    for (int k = 0; k <= kLinks; ++k) {
        const bool is_weight = k == kLinks;
        BodyDef b = ball(is_weight ? 0.3 : 0.04, {(k + 0.5) * kLength, 0, 0}, is_weight ? 1000 : 1);
        if (is_weight) b.position.x() = kWhole + 0.3;
        const BodyId id = world.add_body(b);
        world.add_joint({JointType::kBall, id, last, {k * kLength, 0, 0}});
        last = id;
    }
    bool mixed = false;
    for (int k = 0; k < 90; ++k) {
        mixed |= is_mixed(world.step(kStep));
        Real stretch = 0;
        for (std::size_t j = 0; j < world.joint_count(); ++j) stretch += world.joint_error({static_cast<std::uint32_t>(j), 0}).position;
        REQUIRE(stretch < 1e-3 * kWhole);
    }
    CHECK(mixed);
}
