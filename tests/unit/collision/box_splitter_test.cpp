#include "collision/box_splitter.hpp"

#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace cairn;

namespace {

// Splits down to single boxes; the depth of the deepest.
int depth_of_tree(const BoxSplitter& splitter, int* first, int* last, int depth) {
    if (last - first == 1) return depth;
    int* const middle = splitter.split(first, last, depth);
    REQUIRE((first < middle && middle < last));
    return std::max(depth_of_tree(splitter, first, middle, depth + 1), depth_of_tree(splitter, middle, last, depth + 1));
}

int depth_of_tree(const std::vector<Aabb>& boxes) {
    std::vector<int> order(boxes.size());
    std::iota(order.begin(), order.end(), 0);
    return depth_of_tree(BoxSplitter(boxes), order.data(), order.data() + order.size(), 0);
}

}  // namespace

// 30 levels by area, which may peel off single boxes, then halves of at most 512: 9 more.
TEST_CASE("neither boxes that shrink tenfold each nor boxes at one place make a deep tree") {
    std::vector<Aabb> shrinking, same;
    for (int i = 0; i < 300; ++i) {
        const Real s = std::pow(10.0, -i);
        shrinking.push_back({Vec3(s, 0, 0), Vec3(2 * s, s, s)});
        same.push_back({Vec3::Zero(), Vec3::Ones()});
    }
    CHECK(depth_of_tree(shrinking) <= 39);
    CHECK(depth_of_tree(same) == 9);
}

TEST_CASE("two far groups of boxes are parted between them") {
    std::vector<Aabb> boxes;
    for (int i = 0; i < 10; ++i) {
        const Vec3 at(i % 3 ? i : 100 + i, 0, 0);
        boxes.push_back({at, at + Vec3::Ones()});
    }
    std::vector<int> order(10);
    std::iota(order.begin(), order.end(), 0);
    const int* const middle = BoxSplitter(boxes).split(order.data(), order.data() + 10, 0);
    CHECK(middle - order.data() == 6);
    CHECK(std::all_of(order.data(), order.data() + 6, [](int i) { return i % 3 != 0; }));
    CHECK(BoxSplitter(boxes).bounds(order.data(), middle).hi.x() == 9);
}
