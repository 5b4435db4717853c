#include "collision/broad_phase.hpp"

#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <limits>
#include <random>
#include <set>
#include <utility>

using namespace cairn;

namespace {

using PairSet = std::set<std::pair<ProxyId, ProxyId>>;

constexpr std::uint32_t kLoner = 1u << 31;  // user bit: pairs of two loners are refused

bool accept_all_but_loners(std::uint32_t a, std::uint32_t b) {
    return !(a & b & kLoner);
}

PairSet as_set(const std::vector<ProxyPair>& pairs) {
    PairSet set;
    for (const ProxyPair& p : pairs) set.insert({p.a, p.b});
    return set;
}

bool ascending(const std::vector<ProxyPair>& pairs) {
    return std::is_sorted(pairs.begin(), pairs.end(),
                          [](const ProxyPair& p, const ProxyPair& q) { return std::tie(p.a, p.b) < std::tie(q.a, q.b); });
}

// A broad phase with a plain model of it beside: a list of what is in it.
struct Model {
    struct Entry {
        ProxyId id;
        bool is_static, is_plane;
        Aabb tight;
        Vec3 normal;
        Real offset;
        std::uint32_t user;
    };

    std::mt19937 random;
    BroadPhase broad_phase;
    std::vector<Entry> entries;

    Real extent;  // of the region that boxes are in
    int far = 0;  // boxes that have been made to reach far ahead

    explicit Model(unsigned seed, Real extent_ = 10) : random(seed), extent(extent_) {}

    Real uniform(Real lo, Real hi) { return std::uniform_real_distribution<Real>(lo, hi)(random); }
    Vec3 uniform3(Real size) {
        const Real x = uniform(-size, size), y = uniform(-size, size), z = uniform(-size, size);
        return Vec3(x, y, z);
    }
    bool chance(Real p) { return uniform(0, 1) < p; }

    void add_box(bool is_static) {
        const Vec3 centre = uniform3(extent), half = Vec3::Constant(1.1) + uniform3(1);
        Entry e{0, is_static, false, {centre - half, centre + half}, Vec3::Zero(), 0, chance(0.2) ? kLoner : 0u};
        e.user |= static_cast<std::uint32_t>(entries.size());
        e.id = broad_phase.add(e.tight, is_static, e.user);
        entries.push_back(e);
    }

    void add_plane() {
        Entry e{0, true, true, {}, uniform3(1).normalized(), uniform(-12, -3), 7};
        e.id = broad_phase.add_plane(e.normal, e.offset, e.user);
        entries.push_back(e);
    }

    void remove_any() {
        const std::size_t i = std::uniform_int_distribution<std::size_t>(0, entries.size() - 1)(random);
        broad_phase.remove(entries[i].id);
        entries.erase(entries.begin() + static_cast<std::ptrdiff_t>(i));
    }

    void move_some() {
        for (Entry& e : entries) {
            if (e.is_plane || !chance(e.is_static ? 0.02 : 0.6)) continue;
            const Vec3 d = uniform3(0.4);
            e.tight = {e.tight.lo + d, e.tight.hi + d};
            const bool outside = !broad_phase.fat_aabb(e.id).contains(e.tight);
            const Aabb around = e.tight.grown(0.2);
            CHECK(broad_phase.move(e.id, e.tight, d, chance(0.5) ? &around : nullptr) == outside);
            const Aabb& fat = broad_phase.fat_aabb(e.id);
            CHECK(fat.contains(e.tight));
            far += (fat.hi - fat.lo - (e.tight.hi - e.tight.lo)).maxCoeff() > 3;
        }
    }

    bool overlap(const Entry& a, const Entry& b) const {
        if (a.is_static && b.is_static) return false;
        if (a.is_plane) return reaches(a, broad_phase.fat_aabb(b.id));
        if (b.is_plane) return reaches(b, broad_phase.fat_aabb(a.id));
        return broad_phase.fat_aabb(a.id).overlaps(broad_phase.fat_aabb(b.id));
    }

    // By the eight corners. A box that touches a plane to the last bit could differ from the engine's verdict; random ones do not.
    static bool reaches(const Entry& plane, const Aabb& box) {
        Real lowest = std::numeric_limits<Real>::infinity();
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3 x(corner & 1 ? box.hi.x() : box.lo.x(), corner & 2 ? box.hi.y() : box.lo.y(), corner & 4 ? box.hi.z() : box.lo.z());
            lowest = std::min(lowest, plane.normal.dot(x));
        }
        return lowest <= plane.offset;
    }

    PairSet brute_force() const {
        PairSet set;
        for (const Entry& a : entries)
            for (const Entry& b : entries)
                if (a.id < b.id && accept_all_but_loners(a.user, b.user) && overlap(a, b)) set.insert({a.id, b.id});
        return set;
    }
};

Aabb cube_at(const Vec3& centre, Real half) {
    return {centre - Vec3::Constant(half), centre + Vec3::Constant(half)};
}

}  // namespace

TEST_CASE("the pairs are those of brute force through random motion, adding and removing") {
    const unsigned seed = GENERATE(1u, 2u, 3u);
    const Real extent = GENERATE(10.0, 40.0);
    CAPTURE(seed, extent);
    Model model(seed, extent);
    for (int i = 0; i < 60; ++i) model.add_box(i % 3 == 0);
    for (int i = 0; i < 3; ++i) model.add_plane();

    PairSet known;
    std::vector<ProxyPair> begun, ended;
    std::size_t most = 0;
    for (int step = 0; step < 200; ++step) {
        model.move_some();
        if (model.chance(0.4)) model.remove_any();
        if (model.chance(0.4)) model.add_box(model.chance(0.3));
        if (model.chance(0.05)) model.add_plane();

        model.broad_phase.update_pairs(accept_all_but_loners, begun, ended);
        REQUIRE((ascending(begun) && ascending(ended)));
        for (const auto& pair : as_set(ended)) REQUIRE(known.erase(pair) == 1);
        for (const auto& pair : as_set(begun)) REQUIRE(known.insert(pair).second);
        REQUIRE(known == model.brute_force());
        REQUIRE(model.broad_phase.pair_count() == known.size());
        most = std::max(most, known.size());
    }
    CHECK(most > (extent > 10 ? 5 : 50));  // the test saw something
    CHECK(model.far > 100);
}

TEST_CASE("a query finds what brute force finds, in ascending order") {
    Model model(5);
    for (int i = 0; i < 200; ++i) model.add_box(i % 2 == 0);
    for (int i = 0; i < 3; ++i) model.add_plane();
    std::vector<ProxyId> found;
    for (int i = 0; i < 100; ++i) {
        const Aabb box = cube_at(model.uniform3(12), model.uniform(0.1, 3));
        std::vector<ProxyId> expected;
        for (const Model::Entry& e : model.entries)
            if (e.is_plane ? Model::reaches(e, box) : model.broad_phase.fat_aabb(e.id).overlaps(box)) expected.push_back(e.id);
        std::sort(expected.begin(), expected.end());
        model.broad_phase.query(box, found);
        CHECK(found == expected);
    }
}

TEST_CASE("the pairs do not depend on the order in which the proxies moved") {
    const auto play = [](bool backwards) {
        std::mt19937 random(11);
        std::uniform_real_distribution<Real> uniform(-3, 3);
        BroadPhase broad_phase;
        std::vector<Vec3> at;
        for (int i = 0; i < 80; ++i) {
            const Real x = uniform(random), y = uniform(random), z = uniform(random);
            at.push_back(Vec3(x, y, z));
            broad_phase.add(cube_at(at.back(), 0.4), false, 0);
        }
        std::vector<ProxyPair> begun, ended, log;
        for (int step = 0; step < 20; ++step) {
            for (Vec3& p : at) p += 0.05 * Vec3(uniform(random), uniform(random), uniform(random));
            for (int k = 0; k < 80; ++k) {
                const int i = backwards ? 79 - k : k;
                broad_phase.move(i, cube_at(at[i], 0.4), Vec3::Zero());
            }
            broad_phase.update_pairs([](auto, auto) { return true; }, begun, ended);
            log.insert(log.end(), begun.begin(), begun.end());
            log.insert(log.end(), ended.begin(), ended.end());
        }
        std::vector<std::pair<ProxyId, ProxyId>> flat;
        for (const ProxyPair& p : log) flat.push_back({p.a, p.b});
        return flat;
    };
    const auto forward = play(false);
    CHECK(forward.size() > 100);
    CHECK(forward == play(true));
}

TEST_CASE("a proxy that stays inside its fat box is not touched, and nothing is asked about it") {
    BroadPhase broad_phase;
    const ProxyId a = broad_phase.add(cube_at(Vec3::Zero(), 1), false, 10);
    const ProxyId b = broad_phase.add(cube_at(Vec3(1.5, 0, 0), 1), false, 20);
    int asked = 0;
    const auto count = [&](std::uint32_t x, std::uint32_t y) {
        ++asked;
        CHECK((x == 10 && y == 20));
        return false;
    };
    std::vector<ProxyPair> begun, ended;
    broad_phase.update_pairs(count, begun, ended);
    CHECK(asked == 1);  // once, although both are new

    CHECK_FALSE(broad_phase.move(a, cube_at(Vec3(0.04, 0, 0), 1), Vec3::Zero()));
    CHECK_FALSE(broad_phase.move(a, cube_at(Vec3(std::nan(""), 0, 0), 1), Vec3::Zero()));
    broad_phase.update_pairs(count, begun, ended);
    CHECK(asked == 1);
    CHECK(broad_phase.moved_count() == 0);

    CHECK(broad_phase.move(a, cube_at(Vec3(0.06, 0, 0), 1), Vec3::Zero()));
    broad_phase.update_pairs(count, begun, ended);
    CHECK(asked == 2);
    CHECK(broad_phase.moved_count() == 1);
    CHECK(broad_phase.pair_count() == 0);
    CHECK(broad_phase.user(b) == 20);
}

TEST_CASE("a fat box holds the tight one, reaches ahead along the motion, and not without bound") {
    BroadPhase broad_phase;
    const ProxyId id = broad_phase.add(cube_at(Vec3::Zero(), 1), false, 0);
    const Aabb tight = cube_at(Vec3(5, 0, 0), 1);
    broad_phase.move(id, tight, Vec3(0.2, 1000, -1000));
    const Aabb& fat = broad_phase.fat_aabb(id);
    CHECK(fat.contains(tight));
    CHECK(fat.contains(Aabb{tight.lo + Vec3(0.2, 0, 0), tight.hi + Vec3(0.2, 0, 0)}));
    CHECK((fat.hi - fat.lo).maxCoeff() < 4);
}

TEST_CASE("the pairs of a removed proxy end at the next update, and its id is not given out before that") {
    BroadPhase broad_phase;
    std::vector<ProxyPair> begun, ended;
    const auto all = [](auto, auto) { return true; };
    const ProxyId ground = broad_phase.add_plane(Vec3::UnitZ(), 0, 1);
    const ProxyId box = broad_phase.add(cube_at(Vec3::Zero(), 1), false, 2);
    broad_phase.update_pairs(all, begun, ended);
    CHECK(as_set(begun) == PairSet{{ground, box}});

    broad_phase.remove(ground);
    const ProxyId other = broad_phase.add_plane(Vec3::UnitZ(), 0, 3);
    CHECK(other != ground);
    CHECK(broad_phase.user(ground) == 1);
    broad_phase.update_pairs(all, begun, ended);
    CHECK(as_set(ended) == PairSet{{ground, box}});
    CHECK(as_set(begun) == PairSet{{box, other}});
    CHECK(broad_phase.add_plane(Vec3::UnitZ(), 0, 4) == ground);
}

TEST_CASE("a warmed-up broad phase moves, updates and answers queries without the heap") {
    std::mt19937 random(2);
    std::uniform_real_distribution<Real> uniform(-1, 1);
    BroadPhase broad_phase;
    broad_phase.add_plane(Vec3::UnitZ(), -3, 0);
    std::vector<Vec3> home;
    for (int i = 1; i <= 300; ++i) {
        const Real x = uniform(random), y = uniform(random), z = uniform(random);
        home.push_back(5 * Vec3(x, y, z));
        broad_phase.add(cube_at(home.back(), 0.5), i % 4 == 0, 0);
    }
    std::vector<ProxyPair> begun, ended;
    std::vector<ProxyId> found;
    const std::function<bool(std::uint32_t, std::uint32_t)> all = [](auto, auto) { return true; };
    // The same closed path twice: the second time every pool has its size.
    const auto lap = [&] {
        for (int step = 0; step < 50; ++step) {
            const Vec3 d(std::sin(step * kPi / 25), std::cos(step * kPi / 25), 0);
            for (int i = 0; i < 300; ++i) broad_phase.move(i + 1, cube_at(home[i] + (i % 3) * d, 0.5), Vec3(0.1, 0, 0));
            broad_phase.update_pairs(all, begun, ended);
            broad_phase.query(cube_at(Vec3::Zero(), 5), found);
        }
    };
    lap();
    const std::uint64_t moved = broad_phase.moved_count();
    const std::uint64_t before = allocation_count::count();
    lap();
    if (allocation_count::available()) CHECK(allocation_count::count() == before);
    CHECK(broad_phase.moved_count() > moved + 1000);
}

TEST_CASE("what flies alone is seldom touched, and what it comes near takes its long box away") {
    BroadPhase broad_phase;
    std::vector<ProxyPair> begun, ended;
    const ProxyId flier = broad_phase.add(cube_at(Vec3::Zero(), 0.5), false, 0);
    const ProxyId post = broad_phase.add(cube_at(Vec3(40, 0, 0), 0.5), true, 1);
    const Vec3 d(0.25, 0, 0);
    const auto fly = [&](int steps, Vec3& at) {
        const std::uint64_t before = broad_phase.moved_count();
        for (int k = 0; k < steps; ++k) {
            at += d;
            const Aabb tight = cube_at(at, 0.5).swept(d), around = tight.grown(0.4);
            broad_phase.move(flier, tight, d, &around);
            broad_phase.update_pairs([](std::uint32_t, std::uint32_t) { return true; }, begun, ended);
        }
        return broad_phase.moved_count() - before;
    };
    Vec3 at = Vec3::Zero();
    CHECK(fly(100, at) <= 5);  // 32 displacements ahead
    CHECK(broad_phase.pair_count() == 0);
    fly(50, at);  // 2.5 m before the post: the long box would have paired them 8 m before
    CHECK(broad_phase.pair_count() == 0);
    fly(10, at);
    CHECK(broad_phase.pair_count() == 1);
    CHECK(!broad_phase.fat_aabb(flier).contains(cube_at(at + 8 * d, 0.1)));
    broad_phase.remove(post);
}
