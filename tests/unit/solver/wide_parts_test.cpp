// Large islands cut into parts: the same bits as in one, whoever helps.
#include "engine/base/team.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <thread>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

constexpr int kAlong = 48, kAcross = 6, kUp = 3;

void add_random_contact(Random& random, Island& island, int a, int b) {
    const Vec3 n = random_direction(random);
    std::vector<PointGeometry> points(1 + random() % 4);
    for (PointGeometry& g : points) {
        const Vec3 p = island.bodies.motion[a].x + random_vector(random), gap = uniform(random, -0.02, 0.02) * n;
        const BodyMotion &A = island.bodies.motion[a], &B = island.bodies.motion[b];
        g.core_a_A = A.R.transpose() * (p + gap - A.x);
        g.core_b_B = B.R.transpose() * (p - B.x);
    }
    island.add_contact(a, b, n, random() % 2 ? NormalFrame::kA : NormalFrame::kB, points, random() % 8 == 0 ? 0 : 0.5);
}

// Layers of bodies that touch their neighbours, in random order.
Island random_heap(unsigned seed) {
    Random random(seed);
    Island island;
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < kAlong; ++i)
        for (int k = 0; k < kAcross; ++k)
            for (int l = 0; l < kUp; ++l) {
                BodyMotion m = random_body(random);
                m.x = Vec3(k, i, l) + 0.1 * random_vector(random);
                m.acceleration = Vec3(0, 0, -9.81);
                const int body = island.add_body(m, {random_vector(random), random_vector(random)});
                if (l > 0) pairs.emplace_back(body, body - 1);
                if (l == 0) pairs.emplace_back(body, kImmovable);
                if (k > 0) pairs.emplace_back(body, body - kUp);
                if (i > 0) pairs.emplace_back(body, body - kUp * kAcross);
            }
    std::shuffle(pairs.begin(), pairs.end(), random);
    for (const auto& [a, b] : pairs) add_random_contact(random, island, a, b);
    island.make_states();
    return island;
}

// What three steps come to, with a team or (null) without.
Island after_steps(Island island, Team* team, int& parts) {
    WideContacts memory(&kPortableWideKernel);
    SiSettings settings;
    for (int k = 0; k < 3; ++k) {
        REQUIRE(plan_wide(memory, island.contacts, island.range, settings, &island.bodies, team));
        parts = memory.part_count();
        island.step_states(1.0 / 60, settings, &memory);
    }
    return island;
}

int differences(const Island& p, const Island& q) {
    int count = 0;
    for (int i = 0; i < p.bodies.size(); ++i) {
        count += p.bodies.velocity[i].v != q.bodies.velocity[i].v || p.bodies.velocity[i].w != q.bodies.velocity[i].w;
        count += p.bodies.motion[i].x != q.bodies.motion[i].x || p.bodies.motion[i].q.coeffs() != q.bodies.motion[i].q.coeffs();
    }
    for (std::size_t i = 0; i < p.states.size(); ++i)
        count += p.states[i].warm_velocity != q.states[i].warm_velocity || p.states[i].normal_impulse != q.states[i].normal_impulse;
    return count;
}

}  // namespace

TEST_CASE("an island cut into parts has the bits of one that is not, with helpers and without") {
    const unsigned seed = GENERATE(1u, 2u, 3u);
    const int size = GENERATE(2, 3, 8);
    CAPTURE(seed, size);
    const Island start = random_heap(seed);
    int parts = 0;
    const Island whole = after_steps(start, nullptr, parts);
    CHECK(parts == 1);
    CHECK(differences(start, whole) > 100);  // it is not that nothing happens
    for (const int helpers : {0, 1, size - 1}) {
        CAPTURE(helpers);
        Team team(size);
        REQUIRE(team.take_lead());
        std::vector<std::thread> threads;
        for (int k = 0; k < helpers; ++k) threads.emplace_back([&] { team.help(); });
        const Island cut = after_steps(start, &team, parts);
        team.finish();
        for (std::thread& t : threads) t.join();
        CHECK(parts == size);
        CHECK(differences(whole, cut) == 0);
    }
}

TEST_CASE("an island is not cut where nothing would go side by side") {
    Random random(5);
    Island island = random_heap(5);
    for (int k = 0; k < 2000; ++k) {  // each part would touch all of the others
        const int a = 1 + static_cast<int>(random() % (kAlong * kAcross * kUp)),
                  b = 1 + static_cast<int>(random() % (kAlong * kAcross * kUp));
        if (a != b) add_random_contact(random, island, a, b);
    }
    island.make_states();
    Team team(2);
    int parts = 0;
    after_steps(island, &team, parts);
    CHECK(parts == 1);
}
