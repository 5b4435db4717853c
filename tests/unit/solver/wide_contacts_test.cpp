// Contacts four blocks at a time: the same bits as one at a time.
#include "solver/energy_gain.hpp"
#include "solver/island_probe.hpp"

#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <algorithm>
#include <set>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

std::vector<const WideKernel*> kernels() {
    std::vector<const WideKernel*> list = {&kPortableWideKernel};
    if (best_wide_kernel()) list.push_back(best_wide_kernel());
    return list;
}

void add_random_contact(Random& random, Island& island, int a, int b) {
    const Vec3 n = random_direction(random);
    const NormalFrame frame = std::array{NormalFrame::kWorld, NormalFrame::kA, NormalFrame::kB}[random() % 3];
    std::vector<PointGeometry> points(1 + random() % 4);
    for (PointGeometry& g : points) {
        // Cores so far apart that the gap is between −0.02 m and 0.02 m.
        const Vec3 p = random_vector(random), gap = uniform(random, -0.02, 0.02) * n;
        g.radius_a = uniform(random, 0, 0.2);
        g.radius_b = uniform(random, 0, 0.2);
        const BodyMotion &A = island.bodies.motion[a], &B = island.bodies.motion[b];
        g.core_a_A = A.R.transpose() * (p + gap + g.radius_a * n - A.x);
        g.core_b_B = B.R.transpose() * (p - g.radius_b * n - B.x);
    }
    island.add_contact(a, b, n, frame, points, random() % 8 == 0 ? 0 : uniform(random, 0.1, 1));
    for (int i = 0; i < static_cast<int>(points.size()); ++i) {
        WarmImpulse& warm = island.contacts.warm[island.contacts.blocks.back().first + i];
        if (random() % 3 == 0) continue;
        warm.position = uniform(random, 0, 0.01);
        warm.velocity = uniform(random, -0.005, 0.01);
        if (island.contacts.blocks.back().friction < 0) continue;
        for (int j = 0; j < 2; ++j) {
            warm.friction[j] = uniform(random, -0.002, 0.002);
            warm.friction_first[j] = 0.5 * warm.friction[j];
        }
    }
}

// Random contacts between random bodies; the ground and one kinematic body touch many. Some bodies turn so slowly that rows are kept.
Island random_island(Random& random, int body_count, int contact_count) {
    Island island;
    for (int i = 0; i < body_count; ++i) {
        const BodyVelocity u = {random_vector(random), random_vector(random, random() % 2 ? 3 : 0.01)};
        BodyMotion m = random_body(random);
        m.acceleration = Vec3(0, 0, -9.81);
        island.add_body(m, u);
    }
    const int dynamic_end = island.bodies.size();
    const int belt = island.add_body(immovable_body(Vec3::Zero(), Quat::Identity()), {Vec3::UnitX(), Vec3::UnitZ()});
    island.range.dynamic_end = dynamic_end;
    for (int k = 0; k < contact_count; ++k) {
        const int a = 1 + static_cast<int>(random() % body_count);
        int b = static_cast<int>(random() % (body_count + 1));
        if (k % 8 == 0) b = belt;
        if (a == b) b = 0;
        if (k % 2) {
            add_random_contact(random, island, a, b);
        } else {
            add_random_contact(random, island, b, a);
        }
    }
    island.make_states();
    return island;
}

bool same(const Vec3& a, const Vec3& b) {
    return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
}

// How many bodies and points of the two differ in any number.
int differences(const Island& p, const Island& q) {
    int count = 0;
    for (int i = 0; i < p.bodies.size(); ++i) {
        const BodyMotion &a = p.bodies.motion[i], &b = q.bodies.motion[i];
        const BodyVelocity &u = p.bodies.velocity[i], &w = q.bodies.velocity[i];
        count += !(same(a.x, b.x) && a.q.coeffs() == b.q.coeffs() && same(u.v, w.v) && same(u.w, w.w));
    }
    for (std::size_t i = 0; i < p.states.size(); ++i) {
        const PointState &a = p.states[i], &b = q.states[i];
        count += !(a.warm_position == b.warm_position && a.warm_velocity == b.warm_velocity && same(a.t1, b.t1) &&
                   same(a.warm_friction, b.warm_friction) && same(a.warm_friction_first, b.warm_friction_first) &&
                   a.normal_impulse == b.normal_impulse && a.friction_impulse[0] == b.friction_impulse[0] &&
                   a.friction_impulse[1] == b.friction_impulse[1]);
    }
    return count;
}

bool share_dynamic_body(const ContactBlock& p, const ContactBlock& q) {
    const auto touches = [&](int body, Real inv_mass) { return inv_mass > 0 && (body == q.a || body == q.b); };
    return touches(p.a, p.inv_mass_a) || touches(p.b, p.inv_mass_b);
}

// The batch of each block.
std::vector<int> batches_of_blocks(const WideContacts& wide, int blocks) {
    std::vector<int> batch(blocks, -1);
    for (int k = 0; k < wide.batch_count(); ++k)
        for (int l = 0; l < wide.lanes_of(k); ++l) {
            CHECK(batch[wide.block_of(k, l)] == -1);
            batch[wide.block_of(k, l)] = k;
        }
    return batch;
}

bool plan(WideContacts& wide, const Island& island) {
    return wide.plan(island.contacts, island.range.contacts, island.range.body_begin, island.range.dynamic_end);
}

constexpr Real kStep = 1.0 / 60;  // [s]

SiReport step_wide(Island& island, const SiSettings& settings, WideContacts& memory, IslandProbe* probe = nullptr) {
    REQUIRE(plan_wide(memory, island.contacts, island.range, settings));
    return island.step_states(kStep, settings, &memory, 1, probe);
}

SiReport step_narrow(Island& island, const SiSettings& settings, IslandProbe* probe = nullptr) {
    return island.step_states(kStep, settings, nullptr, 1, probe);
}

}  // namespace

TEST_CASE("contacts solved four blocks at a time give the bits of contacts solved one at a time") {
    const unsigned seed = GENERATE(range(1u, 9u));
    CAPTURE(seed);
    Random random(seed);
    const Island start = random_island(random, 60, 40 + 30 * static_cast<int>(seed));
    SiSettings settings;
    settings.iterations = 1 + static_cast<int>(seed % 3);
    settings.residual_tolerance = seed % 2 ? 0 : 1e-4;
    settings.model.warm_start = seed % 4 != 0;
    for (const WideKernel* kernel : kernels()) {
        CAPTURE(kernel->name);
        Island narrow = start, wide = start;
        WideContacts memory(kernel);
        for (int k = 0; k < 3; ++k) {
            const SiReport a = step_narrow(narrow, settings), b = step_wide(wide, settings, memory);
            CHECK(a.residual == b.residual);
            CHECK(a.contact_sweeps == b.contact_sweeps);
            CHECK(differences(narrow, wide) == 0);
        }
        CHECK(differences(start, wide) > 100);  // it is not that nothing happens
    }
}

TEST_CASE("warm impulses that are far too large throw no bodies apart, to the same bits four blocks at a time") {
    const unsigned seed = GENERATE(range(1u, 9u));
    CAPTURE(seed);
    Random random(seed);
    Island start = random_island(random, 60, 150);
    start.bodies.velocity.back() = {};  // of the belt, which would do work
    for (BodyMotion& m : start.bodies.motion) m.acceleration = Vec3::Zero();
    scale_warm_start(start.contacts, start.range.contacts, 500);
    start.make_states();
    SiSettings settings;
    settings.substeps = 1;
    const auto energy = [](const Island& island) {
        Real sum = 0;
        for (int i = 1; i < island.range.dynamic_end; ++i)
            sum += 0.5 * kinetic_product(island.bodies.motion[i], island.bodies.velocity[i], island.bodies.velocity[i]);
        return sum;
    };
    for (const WideKernel* kernel : kernels()) {
        CAPTURE(kernel->name);
        Island narrow = start, wide = start;
        WideContacts memory(kernel);
        const SiReport report = step_narrow(narrow, settings);
        step_wide(wide, settings, memory);
        CHECK(differences(narrow, wide) == 0);
        CHECK(report.contact_sweeps > 4);  // more than the two solves' own
        CHECK(energy(narrow) <= energy(start) * (1 + 1e-12));
    }
}

TEST_CASE("what is measured of contacts solved four blocks at a time is what is measured of them one at a time") {
    Random random(5);
    Island narrow = random_island(random, 60, 200), wide = narrow;
    SiSettings settings;
    IslandProbe a, b;
    a.begin(narrow.range, settings.model.friction);
    b.begin(wide.range, settings.model.friction);
    WideContacts memory(&kPortableWideKernel);
    step_narrow(narrow, settings, &a);
    step_wide(wide, settings, memory, &b);
    CHECK(differences(narrow, wide) == 0);
    CHECK(a.residual().max > 0);
    CHECK(a.residual().max == b.residual().max);
    CHECK(a.residual().sum_of_squares == b.residual().sum_of_squares);
    CHECK(a.residual().rows == b.residual().rows);
    CHECK(a.residual().index == b.residual().index);
    CHECK(a.work().impacts == b.work().impacts);
    CHECK(a.work().friction == b.work().friction);
    CHECK(a.work().driven == b.work().driven);
    CHECK(a.work().stabilisation == b.work().stabilisation);
}

TEST_CASE("results are warm impulses of the length that is asked for, and totals as they are") {
    Random random(7);
    const Island start = random_island(random, 60, 200);
    Island whole = start, half = start;
    WideContacts memory(&kPortableWideKernel);
    step_wide(whole, {}, memory);
    step_wide(half, {}, memory);
    REQUIRE(differences(whole, half) == 0);
    memory.scale_results(0.5);
    memory.store();
    Real total = 0;
    for (std::size_t i = 0; i < whole.states.size(); ++i) {
        const PointState &a = whole.states[i], &b = half.states[i];
        total += a.normal_impulse;
        CHECK(b.normal_impulse == a.normal_impulse);
        CHECK(b.friction_impulse[1] == a.friction_impulse[1]);
        CHECK(b.warm_position == 0.5 * a.warm_position);
        CHECK(b.warm_velocity == 0.5 * a.warm_velocity);
        CHECK(b.warm_friction == 0.5 * a.warm_friction);
        CHECK(b.warm_friction_first == 0.5 * a.warm_friction_first);
    }
    REQUIRE(total > 0);
    // And only for once.
    WideContacts fresh(&kPortableWideKernel);
    Island again = start, other = start;
    step_wide(again, {}, memory);
    step_wide(other, {}, fresh);
    CHECK(differences(again, other) == 0);
}

TEST_CASE("points are taken over with any tangents, scales and friction models to the same bits, four at a time or one") {
    const unsigned seed = GENERATE(range(1u, 9u));
    CAPTURE(seed);
    Random random(seed);
    Island start = random_island(random, 60, 150);
    // Some that do not slip, nor will: their tangents stay; some that have none yet.
    for (std::size_t i = 0; i < start.states.size(); ++i)
        if (random() % 4 == 0) start.states[i].t1.setZero();
    for (int i = 0; i < start.bodies.size(); ++i) {
        if (random() % 2) start.bodies.velocity[i] = {};
        if (random() % 4 == 0) start.bodies.motion[i].acceleration.setZero();
    }
    SiSettings settings;
    settings.model.friction = seed % 2 ? FrictionModel::kPyramid : FrictionModel::kPyramidFixed;
    settings.model.warm_start = seed % 3 != 0;
    const Real scale = uniform(random, 0.1, 4);
    for (const WideKernel* kernel : kernels()) {
        CAPTURE(kernel->name);
        Island narrow = start, wide = start;
        WideContacts memory(kernel);
        REQUIRE(plan_wide(memory, wide.contacts, wide.range, settings));
        narrow.step_states(kStep, settings, nullptr, scale);
        wide.step_states(kStep, settings, &memory, scale);
        CHECK(differences(narrow, wide) == 0);
        int unset = 0;
        for (const ContactBlock& block : wide.contacts.blocks)
            for (int i = 0; i < block.count && block.friction >= 0; ++i) unset += !(std::abs(block.states[i].t1.norm() - 1) < 1e-12);
        CHECK(unset == 0);
    }
}

TEST_CASE("the largest warm impulse is found, and all are scaled, four blocks at a time as one at a time") {
    Random random(13);
    const Island start = random_island(random, 60, 150);
    Island narrow = start, wide = start;
    WideContacts memory(&kPortableWideKernel);
    REQUIRE(plan_wide(memory, wide.contacts, wide.range, {}));
    for (Island* island : {&narrow, &wide})
        for (ContactBlock& block : island->contacts.blocks) block.states = &island->states[block.first];
    const PointLoad load{kStep, FrictionModel::kPyramid, 1};
    load_points(narrow.contacts, narrow.range.contacts, narrow.bodies, load);
    memory.pack(wide.contacts, wide.bodies, wide.range.body_begin, wide.range.body_end, load);
    const Real largest = largest_warm(narrow.contacts, narrow.range.contacts);
    REQUIRE(largest > 0);
    CHECK(memory.largest_warm() == largest);
    memory.scale_warm(0.25);
    CHECK(memory.largest_warm() == 0.25 * largest);
}

TEST_CASE("contacts of one island after another, smaller one leave nothing of it") {
    Random random(11);
    const Island big = random_island(random, 60, 300), small = random_island(random, 40, 60);
    WideContacts fresh(&kPortableWideKernel), used(&kPortableWideKernel);
    Island first = big, a = small, b = small;
    step_wide(first, {}, used);
    step_wide(a, {}, fresh);
    step_wide(b, {}, used);
    CHECK(differences(a, b) == 0);
}

TEST_CASE("blocks of a batch share no dynamic body, and blocks that share one keep their order") {
    const unsigned seed = GENERATE(range(1u, 6u));
    CAPTURE(seed);
    Random random(seed);
    const Island island = random_island(random, 50, 200);
    WideContacts wide(&kPortableWideKernel);
    REQUIRE(plan(wide, island));
    const std::vector<ContactBlock>& blocks = island.contacts.blocks;
    const int count = static_cast<int>(blocks.size());
    const std::vector<int> batch = batches_of_blocks(wide, count);
    CHECK(std::count(batch.begin(), batch.end(), -1) == 0);
    int misplaced = 0;
    for (int k = 0; k < count; ++k)
        for (int l = k + 1; l < count; ++l) misplaced += share_dynamic_body(blocks[k], blocks[l]) && batch[k] >= batch[l];
    CHECK(misplaced == 0);
    for (int k = 0; k < wide.batch_count(); ++k) CHECK(wide.lanes_of(k) <= kLanes);

    WideContacts again(&kPortableWideKernel);
    REQUIRE(plan(again, island));
    CHECK(batches_of_blocks(again, count) == batch);
}

TEST_CASE("a chain of contacts, each of which waits for the one below, is not batched") {
    Random random(3);
    Island island;
    for (int i = 0; i < 60; ++i) island.add_body(random_body(random), {});
    for (int i = 1; i < 60; ++i) add_random_contact(random, island, i, i - 1);
    WideContacts wide(&kPortableWideKernel);
    CHECK_FALSE(plan(wide, island));
}
