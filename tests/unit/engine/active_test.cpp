// The lists by which a step passes over what moves, against sets kept the plain way.
#include "engine/active_list.hpp"
#include "engine/links.hpp"

#include "tests/support/catch.hpp"

#include <map>
#include <random>
#include <set>

using namespace cairn;

TEST_CASE("an active list holds what was added and not filtered out, ascending and once") {
    std::mt19937 random(GENERATE(1u, 2u, 3u));
    ActiveList list;
    std::set<std::uint32_t> wanted;
    const auto holds_wanted = [&] { return list.numbers() == std::vector<std::uint32_t>(wanted.begin(), wanted.end()); };
    for (int round = 0; round < 200; ++round) {
        for (int k = 0; k < 10; ++k) {
            const std::uint32_t number = random() % 100;
            list.add(number);
            wanted.insert(number);
            CHECK(list.contains(number));
        }
        if (round % 3 != 0) list.merge();  // else filtered while they wait
        if (round % 3 == 1) CHECK(holds_wanted());
        const std::uint32_t out = random() % 5;
        list.filter([&](std::uint32_t number) { return number % 5 != out; });
        std::erase_if(wanted, [&](std::uint32_t number) { return number % 5 == out; });
        list.merge();
        REQUIRE(holds_wanted());
    }
}

TEST_CASE("links give each body the edges that hang on it") {
    std::mt19937 random(GENERATE(1u, 2u, 3u));
    constexpr std::uint32_t bodies = 12, edges = 60;
    Links links;
    std::map<std::uint32_t, std::pair<std::uint32_t, std::uint32_t>> wanted;
    for (int round = 0; round < 2000; ++round) {
        const std::uint32_t edge = random() % edges;
        if (wanted.contains(edge)) {
            links.remove(edge);
            wanted.erase(edge);
        } else {
            const std::uint32_t a = random() % bodies, b = random() % 7 == 0 ? Links::kNoEnd : (a + 1 + random() % (bodies - 1)) % bodies;
            links.add(edge, a, b);
            wanted[edge] = {a, b};
        }
        links.remove(edges + 5);  // never linked
        for (std::uint32_t body = 0; body < bodies; ++body) {
            std::map<std::uint32_t, std::uint32_t> found, expected;
            links.for_each(body, [&](std::uint32_t e, std::uint32_t other) { found[e] = other; });
            for (const auto& [e, ends] : wanted)
                if (ends.first == body || ends.second == body) expected[e] = ends.first == body ? ends.second : ends.first;
            REQUIRE(found == expected);
        }
    }
}
