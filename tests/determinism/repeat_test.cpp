// The same calls give the same bits: in a second run, in a world beside the first, and when the steps of two worlds alternate.
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

void build_pile(World& world, std::uint32_t seed) {
    Random r(seed);
    world.add_body(ground());
    for (int k = 0; k < 40; ++k) {
        BodyDef b = body(random_shape(r), Vec3(r.uniform(-0.8, 0.8), r.uniform(-0.8, 0.8), 0.5 + 0.2 * k), r.uniform(0.5, 3));
        b.rotation = r.rotation();
        b.angular_velocity = r.vector(2);
        b.restitution = k % 5 == 0 ? 0.4 : 0;
        world.add_body(b);
    }
}

void build_joints(World& world, std::uint32_t seed) {
    Random r(seed);
    world.add_body(ground());
    BodyId previous;
    for (int k = 0; k < 16; ++k) {
        BodyDef b = body(Shape::capsule(0.08, 0.15), {0.4 * k, 0, 2});
        b.linear_velocity = r.vector(1);
        const BodyId id = world.add_body(b);
        JointDef j{static_cast<JointType>(k % 5), id, previous, {0.4 * k - 0.2, 0, 2}, {0.4 * k + 0.1, 0.1, 2}, Vec3::UnitY()};
        world.add_joint(j);
        if (k % 5 != 4) previous = id;
    }
}

using Build = void (*)(World&, std::uint32_t);

std::vector<std::uint64_t> hashes(Build build, std::uint32_t seed, const WorldSettings& settings, int steps) {
    World world(settings);
    build(world, seed);
    std::vector<std::uint64_t> out;
    for (int k = 0; k < steps; ++k) {
        world.step(kStep);
        out.push_back(world.hash());
    }
    return out;
}

}  // namespace

TEST_CASE("two runs of the same calls have the same bits in every step") {
    const auto [name, build] = GENERATE(table<const char*, Build>({{"pile", build_pile}, {"joints", build_joints}}));
    const auto stabilisation = GENERATE(Stabilisation::kTargetVelocity, WorldSettings{}.stabilisation);
    const bool sleep = GENERATE(false, true);
    CAPTURE(name, static_cast<int>(stabilisation), sleep);
    WorldSettings settings;
    settings.stabilisation = stabilisation;
    settings.sleep = sleep;
    const std::vector<std::uint64_t> first = hashes(build, 1, settings, 120), second = hashes(build, 1, settings, 120);
    for (std::size_t k = 0; k < first.size(); ++k) {
        CAPTURE(k);
        REQUIRE(first[k] == second[k]);
    }
    CHECK(first != hashes(build, 2, settings, 120));  // the hash sees what happens
}

TEST_CASE("a world beside another one has the bits it has alone") {
    const auto [name, build] = GENERATE(table<const char*, Build>({{"pile", build_pile}, {"joints", build_joints}}));
    CAPTURE(name);
    const std::vector<std::uint64_t> alone = hashes(build, 1, {}, 120);
    World first, second, other;
    build(first, 1);
    build_pile(other, 3);
    build(second, 1);
    for (std::size_t k = 0; k < alone.size(); ++k) {
        CAPTURE(k);
        first.step(kStep);
        other.step(kStep / 2);
        second.step(kStep);
        REQUIRE(first.hash() == alone[k]);
        REQUIRE(second.hash() == alone[k]);
    }
}

TEST_CASE("a world that takes bodies out and in again repeats itself") {
    const auto act = [] {
        World world;
        build_pile(world, 5);
        std::vector<std::uint64_t> out;
        for (int k = 0; k < 100; ++k) {
            if (k % 10 == 5) world.remove_body(world.bodies()[1 + k % 30]);
            if (k % 10 == 9) world.add_body(cube(0.4, {0.1, 0.1, 4}));
            if (k == 50) world.apply_impulse(world.bodies()[7], {0, 0, 5}, {0, 0, 0});
            world.step(kStep);
            out.push_back(world.hash());
        }
        return out;
    };
    CHECK(act() == act());
}

TEST_CASE("reading a world changes nothing in it") {
    World read, left;
    build_pile(read, 1);
    build_pile(left, 1);
    for (int k = 0; k < 60; ++k) {
        read.step(kStep);
        left.step(kStep);
        read.manifolds();
        read.bodies();
        read.kinetic_energy();
        read.potential_energy();
        REQUIRE(read.hash() == left.hash());
    }
}
