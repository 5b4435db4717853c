#include "engine/island.hpp"

#include "tests/support/catch.hpp"

#include <algorithm>
#include <numeric>
#include <random>

using namespace cairn;

namespace {

struct Edge {
    std::uint32_t a, b;
    int kind;
    std::uint32_t item;
};

struct Group {
    std::vector<std::uint32_t> bodies, items[2];
    bool operator==(const Group&) const = default;
};

// Bodies joined by an edge, spread from the lowest one until nothing more is reached.
std::vector<Group> flood_fill(std::uint32_t bodies, const std::vector<Edge>& edges) {
    std::vector<int> group(bodies, -1);
    std::vector<char> member(bodies, 0);
    for (const Edge& e : edges)
        for (std::uint32_t i : {e.a, e.b})
            if (i != UINT32_MAX) member[i] = 1;
    std::vector<Group> out;
    for (std::uint32_t start = 0; start < bodies; ++start) {
        if (!member[start] || group[start] >= 0) continue;
        const int id = static_cast<int>(out.size());
        Group g;
        std::vector<std::uint32_t> front = {start};
        group[start] = id;
        while (!front.empty()) {
            const std::uint32_t i = front.back();
            front.pop_back();
            g.bodies.push_back(i);
            for (const Edge& e : edges) {
                if (e.a != i && e.b != i) continue;
                const std::uint32_t other = e.a == i ? e.b : e.a;
                if (other == UINT32_MAX || group[other] >= 0) continue;
                group[other] = id;
                front.push_back(other);
            }
        }
        std::sort(g.bodies.begin(), g.bodies.end());
        for (const Edge& e : edges)
            if (group[e.a == UINT32_MAX ? e.b : e.a] == id) g.items[e.kind].push_back(e.item);
        out.push_back(g);
    }
    return out;
}

std::vector<Group> build(IslandBuilder& builder, std::uint32_t bodies, const std::vector<Edge>& edges) {
    std::vector<std::uint32_t> awake(bodies);
    std::iota(awake.begin(), awake.end(), 0u);
    builder.begin(bodies, awake);
    for (const Edge& e : edges) builder.add(e.a, e.b, e.kind, e.item);
    builder.finish();
    std::vector<Group> out;
    for (int k = 0; k < builder.count(); ++k) {
        Group g;
        const IndexRange b = builder.bodies(k);
        g.bodies.assign(builder.body_list().begin() + b.begin, builder.body_list().begin() + b.end);
        for (int kind = 0; kind < 2; ++kind) {
            const IndexRange r = builder.items(k, kind);
            g.items[kind].assign(builder.item_list(kind).begin() + r.begin, builder.item_list(kind).begin() + r.end);
        }
        out.push_back(g);
    }
    return out;
}

std::vector<Edge> random_edges(std::mt19937& random, std::uint32_t bodies, int count) {
    std::vector<Edge> edges;
    for (int k = 0; k < count; ++k) {
        Edge e{static_cast<std::uint32_t>(random() % bodies), static_cast<std::uint32_t>(random() % bodies), static_cast<int>(random() % 2),
               static_cast<std::uint32_t>(k)};
        if (e.a == e.b) e.b = UINT32_MAX;
        if (random() % 8 == 0) (random() % 2 ? e.a : e.b) = UINT32_MAX;
        if (e.a == UINT32_MAX && e.b == UINT32_MAX) e.a = 0;
        edges.push_back(e);
    }
    return edges;
}

}  // namespace

TEST_CASE("islands are what a flood fill over the constraints finds") {
    const auto seed = GENERATE(range(1u, 41u));
    CAPTURE(seed);
    std::mt19937 random(seed);
    IslandBuilder builder;  // reused, as the world does
    for (int round = 0; round < 5; ++round) {
        const std::uint32_t bodies = 1 + random() % 60;
        const std::vector<Edge> edges = random_edges(random, bodies, static_cast<int>(random() % 50));
        const std::vector<Group> truth = flood_fill(bodies, edges);
        REQUIRE(build(builder, bodies, edges) == truth);
        std::vector<char> member(bodies, 0);
        for (const Group& g : truth)
            for (std::uint32_t i : g.bodies) member[i] = 1;
        for (std::uint32_t i = 0; i < bodies; ++i) REQUIRE(builder.is_member(i) == static_cast<bool>(member[i]));
    }
}

TEST_CASE("islands do not depend on the order in which constraints are added") {
    const auto seed = GENERATE(range(1u, 21u));
    CAPTURE(seed);
    std::mt19937 random(seed);
    const std::uint32_t bodies = 40;
    std::vector<Edge> edges = random_edges(random, bodies, 35);
    const auto sorted = [](std::vector<Group> groups) {  // items come as they were added
        for (Group& g : groups)
            for (auto& items : g.items) std::sort(items.begin(), items.end());
        return groups;
    };
    IslandBuilder builder;
    const std::vector<Group> first = sorted(build(builder, bodies, edges));
    for (int round = 0; round < 10; ++round) {
        std::shuffle(edges.begin(), edges.end(), random);
        for (Edge& e : edges)
            if (random() % 2) std::swap(e.a, e.b);
        REQUIRE(sorted(build(builder, bodies, edges)) == first);
    }
}

TEST_CASE("no constraint, no island; a body held by the world alone is one") {
    IslandBuilder builder;
    CHECK(build(builder, 5, {}).empty());
    CHECK(build(builder, 0, {}).empty());
    const std::vector<Group> one = build(builder, 5, {{UINT32_MAX, 3, IslandBuilder::kJoint, 9}});
    REQUIRE(one.size() == 1);
    CHECK(one[0].bodies == std::vector<std::uint32_t>{3});
    CHECK(one[0].items[IslandBuilder::kJoint] == std::vector<std::uint32_t>{9});
    CHECK(one[0].items[IslandBuilder::kContact].empty());
    CHECK_FALSE(builder.is_member(2));
}
