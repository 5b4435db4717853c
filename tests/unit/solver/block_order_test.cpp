// The order in which an island's contacts are swept.
#include "solver/block_order.hpp"

#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <algorithm>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

using Pairs = std::vector<std::pair<int, int>>;  // of bodies; 0 does not move

Island island_of(const Pairs& pairs) {
    Random random(5);
    Island island;
    int bodies = 0;
    for (const auto& [a, b] : pairs) bodies = std::max({bodies, a, b});
    for (int i = 0; i < bodies; ++i) island.add_body(random_body(random), {});
    for (const auto& [a, b] : pairs) island.add_contact(a, b, Vec3::UnitZ(), NormalFrame::kWorld, std::vector<PointGeometry>(1), 0.5);
    return island;
}

Pairs pairs_of(const Island& island) {
    Pairs pairs;
    for (const ContactBlock& block : island.contacts.blocks) pairs.emplace_back(block.a, block.b);
    return pairs;
}

bool spread(BlockOrder& order, Island& island) {
    return order.spread(island.contacts, island.range.contacts, island.range.body_begin, island.range.dynamic_end);
}

// Each of a row stands on the ground and touches the one before: 1-0, 2-0, 2-1, 3-0, 3-2, ...
Pairs row_of(int count) {
    Pairs pairs = {{1, 0}};
    for (int i = 2; i <= count; ++i) {
        pairs.emplace_back(i, 0);
        pairs.emplace_back(i, i - 1);
    }
    return pairs;
}

}  // namespace

TEST_CASE("a row that leans on itself is swept from the ground up, every other contact between neighbours at a time") {
    const Pairs row = row_of(20);
    Island island = island_of(row);
    BlockOrder order;
    REQUIRE(spread(order, island));
    const Pairs now = pairs_of(island);
    for (std::size_t k = 0; k < row.size(); ++k) {
        CAPTURE(k);
        CHECK(now[k] == row[order.source(static_cast<int>(k))]);
        CHECK((now[k].second == 0) == (k < 20));
        if (k >= 20) CHECK((now[k].first % 2 == 0) == (k < 30));
        CHECK(island.contacts.blocks[k].first == order.source(static_cast<int>(k)));  // its points are its own
    }
    Pairs sorted = now, all = row;
    std::sort(sorted.begin(), sorted.end());
    std::sort(all.begin(), all.end());
    CHECK(sorted == all);
    CHECK_FALSE(spread(order, island));  // it is no chain any more
}

TEST_CASE("what carries loads up a stack keeps its order, and so do few contacts") {
    Pairs stack;
    for (int i = 1; i <= 30; ++i) stack.emplace_back(i, i - 1);
    for (const Pairs& pairs : {stack, row_of(6)}) {
        Island island = island_of(pairs);
        BlockOrder order;
        CHECK_FALSE(spread(order, island));
        CHECK(pairs_of(island) == pairs);
    }
}

TEST_CASE("contacts farther from the ground are swept later, and those of bodies that nothing holds are spread as well") {
    // Two that stand on a row of 24, of which the first two hang on the third.
    Pairs row = {{25, 3}, {26, 10}}, chain;
    for (const auto& pair : row_of(24))
        if (pair != std::pair{1, 0} && pair != std::pair{2, 0}) row.push_back(pair);
    for (int i = 2; i <= 30; ++i) chain.emplace_back(i, i - 1);
    Island island = island_of(row), flying = island_of(chain);
    BlockOrder order;
    REQUIRE(spread(order, island));
    const auto depth = [](int body) { return body == 0 ? 0 : body == 1 ? 3 : body == 2 || body > 24 ? 2 : 1; };
    int last = 0;
    for (const auto& [a, b] : pairs_of(island)) {
        CAPTURE(a, b);
        CHECK(depth(a) + depth(b) >= last);
        last = depth(a) + depth(b);
    }
    CHECK(last == 5);
    REQUIRE(spread(order, flying));
    for (std::size_t k = 0; k < chain.size(); ++k) CHECK((pairs_of(flying)[k].first % 2 == 0) == (k < 15));
}

TEST_CASE("a stack is as deep as it is high, whatever the order of its contacts; a row is not, and what nothing holds is deeper than all") {
    constexpr int kHeight = 9;
    const auto is_within = [](const Pairs& pairs, int most) {
        const Island island = island_of(pairs);
        std::vector<int> depth;
        return is_shallow(island.contacts.blocks, island.range.body_begin, island.range.dynamic_end, most, depth);
    };
    Pairs stack;
    for (int i = 1; i <= kHeight; ++i) stack.emplace_back(i, i - 1);
    const bool from_above = GENERATE(false, true);
    if (from_above) std::reverse(stack.begin(), stack.end());
    CHECK(is_within(stack, kHeight));
    CHECK_FALSE(is_within(stack, kHeight - 1));
    stack.emplace_back(0, kHeight);  // held from above, too
    CHECK(is_within(stack, (kHeight + 1) / 2));
    CHECK_FALSE(is_within(stack, (kHeight + 1) / 2 - 1));
    CHECK(is_within(row_of(20), 1));
    Pairs flying;
    for (int i = 2; i <= 4; ++i) flying.emplace_back(i, i - 1);
    CHECK_FALSE(is_within(flying, 100));
}
