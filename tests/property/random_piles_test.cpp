// Laws that hold whatever the scene: random seeds, no particular truth.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

// A heap of mixed shapes falling on the ground. Meant to be messy: they touch, roll, slide and rest.
void build_pile(World& world, std::uint32_t seed, int count, Real restitution) {
    Random r(seed);
    BodyDef floor = ground(r.uniform(0.1, 0.9), restitution);
    world.add_body(floor);
    for (int k = 0; k < count; ++k) {
        BodyDef b = body(random_shape(r), Vec3(r.uniform(-0.7, 0.7), r.uniform(-0.7, 0.7), 0.5 + 0.35 * k), r.uniform(0.5, 4));
        b.friction = r.below(6) == 0 ? 0 : r.uniform(0.1, 1);
        b.restitution = restitution;
        b.rotation = r.rotation();
        b.angular_velocity = r.vector(3);
        world.add_body(b);
    }
}

// A cloud of bodies without gravity that fly into each other, some of them jointed.
void build_cloud(World& world, std::uint32_t seed, bool joints, Real friction, Real restitution) {
    Random r(seed);
    BodyId previous;
    for (int k = 0; k < 27; ++k) {
        const Vec3 cell(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        BodyDef b = body(random_shape(r), 0.9 * cell + r.vector(0.05), r.uniform(0.5, 4));
        b.friction = friction;
        b.restitution = restitution;
        b.rotation = r.rotation();
        b.linear_velocity = -1.5 * cell + r.vector(0.5);  // inwards
        b.angular_velocity = r.vector(2);
        const BodyId id = world.add_body(b);
        if (joints && k % 3 != 0) {
            const Vec3 middle = 0.5 * (world.state(id).position + world.state(previous).position);
            world.add_joint({static_cast<JointType>(k % 5), id, previous, middle, world.state(previous).position, r.vector(1)});
        }
        previous = id;
    }
}

struct Scale {
    Real linear = 0, angular = 0;  // Σ ‖m v‖, Σ ‖x × m v‖ + ‖I ω‖ at most
};

Scale momentum_scale(const World& world) {
    Scale s;
    for (BodyId id : world.bodies()) {
        const BodyState b = world.state(id);
        s.linear += world.mass(id) * b.linear_velocity.norm();
        s.angular += world.mass(id) * b.position.norm() * b.linear_velocity.norm() + world.inertia(id).norm() * b.angular_velocity.norm();
    }
    return s;
}

}  // namespace

TEST_CASE("in any pile contacts push and friction stays within μ λ_N") {
    const auto seed = GENERATE(range(1u, 7u));
    CAPTURE(seed);
    World world;
    build_pile(world, seed, 20, 0);
    std::size_t points = 0;
    for (int step = 0; step < 120; ++step) {
        REQUIRE(world.step(kStep).ok);
        for (const ManifoldView& m : world.manifolds()) {
            for (int k = 0; k < m.count; ++k) {
                const ContactPointView& p = m.points[k];
                ++points;
                REQUIRE(p.normal_impulse >= 0);
                // Holds per substep and sweep by clamping, so for the sums too, up to rounding.
                const Real limit = m.friction * p.normal_impulse * (1 + 1e-9);
                REQUIRE(std::abs(p.friction_impulse[0]) <= limit);
                REQUIRE(std::abs(p.friction_impulse[1]) <= limit);
            }
        }
    }
    CHECK(points > 1000);
}

TEST_CASE("contacts and joints conserve the linear momentum of an isolated system") {
    const auto seed = GENERATE(range(1u, 7u));
    const bool joints = GENERATE(false, true);
    CAPTURE(seed, joints);
    World world(no_gravity());
    build_cloud(world, seed, joints, 0.5, seed % 2 ? 0 : 0.5);
    const Vec3 before = linear_momentum(world);
    const Real scale = momentum_scale(world).linear;
    std::uint32_t rows = 0;
    run(world, 1, kStep, [&](const StepReport& r) { rows += r.normal_rows + r.joint_rows; });
    CHECK((linear_momentum(world) - before).norm() < 1e-9 * scale);
    CHECK(rows > 100);
}

TEST_CASE("contacts conserve the angular momentum of an isolated system") {
    const auto seed = GENERATE(range(1u, 7u));
    CAPTURE(seed);
    World world(no_gravity());
    build_cloud(world, seed, false, 0.5, 0);
    const Vec3 before = angular_momentum(world);
    const Real scale = momentum_scale(world).angular;
    run(world, 1);
    // The two arms of a contact point end at one point, so the impulses have no moment; arms are kept while a body turns by 1e-3 rad,
    // which leaves that share of an impulse's moment at most.
    CHECK((angular_momentum(world) - before).norm() < 1e-3 * scale);
}

TEST_CASE("to every impulse on a body there is the opposite one: a pair of bodies changes its momentum by nothing") {
    const auto seed = GENERATE(range(1u, 13u), value(221u));
    CAPTURE(seed);
    Random r(seed);
    World world(no_gravity());
    BodyDef a = body(random_shape(r), {-0.6, 0, 0}, r.uniform(0.1, 10)), b = body(random_shape(r), {0.6, 0.1, 0}, r.uniform(0.1, 10));
    a.rotation = r.rotation(), b.rotation = r.rotation();
    a.linear_velocity = {2, 0, 0}, b.linear_velocity = {-1, 0, 0.1};
    const BodyId ids[2] = {world.add_body(a), world.add_body(b)};
    const auto fastest_spin = [&] {
        return std::max(world.state(ids[0]).angular_velocity.norm(), world.state(ids[1]).angular_velocity.norm());
    };
    bool touched = false;
    for (int step = 0; step < 60; ++step) {
        const Vec3 p0[2] = {a.mass * world.state(ids[0]).linear_velocity, b.mass * world.state(ids[1]).linear_velocity};
        const Real spin = fastest_spin();
        world.step(kStep);
        const Vec3 p1[2] = {a.mass * world.state(ids[0]).linear_velocity, b.mass * world.state(ids[1]).linear_velocity};
        REQUIRE((p1[0] - p0[0] + p1[1] - p0[1]).norm() < 1e-13 * (p0[0].norm() + p0[1].norm()));
        // What the manifolds report is what the first body got.
        Vec3 impulse = Vec3::Zero();
        for (const ManifoldView& m : world.manifolds())
            for (int k = 0; k < m.count; ++k) {
                const ContactPointView& p = m.points[k];
                impulse +=
                    (m.body_a == ids[0] ? 1 : -1) * (p.normal_impulse * m.n + p.friction_impulse[0] * p.t1 + p.friction_impulse[1] * p.t2);
            }
        touched |= impulse.norm() > 0;
        // n turns with the body that owns it during the step, by ω dt; the view has the one of its start. (Seed 221: friction of an impact
        // that the substep after it kept for half of itself, with nothing to hold it. In one or two of a hundred seeds an impulse that the
        // first solve gives and the second takes back along the turned n is over this bound; it is of second order in the step.)
        const Real turned = kStep * std::max(spin, fastest_spin());
        CAPTURE(step, impulse.transpose(), (p1[0] - p0[0]).transpose(), spin, world.manifolds().size());
        CHECK((p1[0] - p0[0] - impulse).norm() <= turned * impulse.norm() + 1e-12 * p0[0].norm());
    }
    CHECK(touched);
}

TEST_CASE("without restitution a pile on the ground never gains energy") {
    // (Seed 17: impulses of an impact that was over threw bodies apart, with 20 J of nothing.)
    const auto seed = GENERATE(range(1u, 61u));
    CAPTURE(seed);
    World world;
    build_pile(world, seed, 20, 0);
    Real mass = 0;
    for (BodyId id : world.bodies()) mass += world.mass(id);
    const Real start = world.kinetic_energy() + world.potential_energy();
    const Real substep = kStep / 2, fall = 0.5 * kG * substep * substep;
    Real before = start;
    for (int step = 0; step < 180; ++step) {
        const StepReport report = world.step(kStep);
        REQUIRE(report.ok);
        const Real after = world.kinetic_energy() + world.potential_energy();
        // A penetration is worked off by moving bodies up, without leaving a velocity: pushes of a quarter of it in four substeps, or of
        // 1 − 0.75² in two, lift what lies on it by 1 − 0.75⁴ = 0.684 of the deepest one at most. What meets the ground is stopped at the
        // beginning of a substep, not where it arrives: where it is no faster than gravity makes it in a substep, that keeps it higher by
        // what it falls in one.
        REQUIRE(after - before < (0.69 * report.max_penetration + fall) * mass * kG);
        before = after;
    }
    CHECK(before < start);
}
