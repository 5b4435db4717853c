#include "engine/pair_map.hpp"

#include "tests/support/catch.hpp"

#include <map>
#include <random>

using namespace cairn;

TEST_CASE("a pair map agrees with std::map under random inserts and erases") {
    const auto seed = GENERATE(1u, 2u, 3u, 4u);
    CAPTURE(seed);
    std::mt19937 random(seed);
    PairMap map;
    std::map<std::uint64_t, std::uint32_t> truth;
    // Few keys, so that inserts meet erases of the same key and probe runs are long at the load limit.
    const auto key = [&] { return std::uint64_t{random() % 40} << 32 | random() % 20; };
    for (int k = 0; k < 20000; ++k) {
        const std::uint64_t at = key();
        // Phases of growing and of shrinking.
        const bool grow = (k / 2000) % 2 == 0 ? random() % 4 != 0 : random() % 4 == 0;
        if (!grow) {
            map.erase(at);
            truth.erase(at);
        } else if (!truth.contains(at)) {
            map.insert(at, static_cast<std::uint32_t>(k));
            truth[at] = static_cast<std::uint32_t>(k);
        }
        REQUIRE(map.size() == truth.size());
        const std::uint64_t asked = key();
        const auto found = truth.find(asked);
        REQUIRE(map.find(asked) == (found == truth.end() ? PairMap::kNone : found->second));
        if (k % 500 == 0)
            for (const auto& [k2, value] : truth) REQUIRE(map.find(k2) == value);
    }
}

TEST_CASE("an empty pair map finds nothing and erases nothing") {
    PairMap map;
    CHECK(map.find(7) == PairMap::kNone);
    map.erase(7);
    CHECK(map.size() == 0);
    map.insert(7, 1);
    map.erase(7);
    map.erase(7);
    CHECK(map.size() == 0);
    CHECK(map.find(7) == PairMap::kNone);
}
