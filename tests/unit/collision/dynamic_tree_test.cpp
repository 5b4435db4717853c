#include "collision/dynamic_tree.hpp"

#include "tests/support/catch.hpp"

#include <algorithm>
#include <random>

using namespace cairn;

namespace {

Aabb cube_at(const Vec3& centre, Real half) {
    return {centre - Vec3::Constant(half), centre + Vec3::Constant(half)};
}

std::vector<int> found(const DynamicTree& tree, const Aabb& box) {
    std::vector<int> items;
    tree.query(box, [&](int item) { items.push_back(item); });
    std::sort(items.begin(), items.end());
    return items;
}

std::vector<int> brute_force(const std::vector<Aabb>& boxes, const Aabb& box) {
    std::vector<int> items;
    for (int i = 0; i < static_cast<int>(boxes.size()); ++i)
        if (boxes[i].overlaps(box)) items.push_back(i);
    return items;
}

}  // namespace

TEST_CASE("a tree finds what brute force finds after any mixture of changes and rebuilds") {
    const unsigned seed = GENERATE(1u, 2u, 3u);
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<Real> uniform(-1, 1);
    const auto any_box = [&] {
        const Real x = uniform(random), y = uniform(random), z = uniform(random);
        return cube_at(10 * Vec3(x, y, z), std::pow(10.0, uniform(random)) / 2);
    };
    const Aabb away = cube_at(Vec3::Constant(1e6), 1);
    DynamicTree tree;
    std::vector<Aabb> boxes;
    std::vector<int> leaves;
    for (int i = 0; i < 200; ++i) {
        boxes.push_back(any_box());
        leaves.push_back(tree.insert(boxes.back(), i));
    }
    for (int round = 0; round < 300; ++round) {
        const int i = std::uniform_int_distribution<int>(0, 199)(random);
        boxes[i] = any_box();
        if (round % 3 == 0) {  // out and in again, with another box among them meanwhile
            const int other = tree.insert(away, 999);
            tree.remove(leaves[i]);
            leaves[i] = tree.insert(boxes[i], i);
            tree.remove(other);
        } else {
            tree.set_box(leaves[i], boxes[i]);
            if (round % 3 == 1) tree.reinsert(leaves[i]);
        }
        if (round % 50 == 49) tree.rebuild();
        if (round % 50 == 24) tree.refit_all();
        REQUIRE(tree.size() == 200);
        const Aabb box = any_box();
        REQUIRE(found(tree, box) == brute_force(boxes, box));
        REQUIRE(found(tree, away).empty());
    }
    for (const int leaf : leaves) tree.remove(leaf);
    CHECK(tree.size() == 0);
    tree.rebuild();
    CHECK(found(tree, cube_at(Vec3::Zero(), 100)).empty());
}

// The flat copy is in single precision, rounded outwards: boxes that touch in a point are told wherever they are, and no others.
TEST_CASE("a tree that was just built tells boxes that touch in a point, wherever they are and however large") {
    const Real size = GENERATE(1e-30, 1e-3, 1.0, 1e6, 1e300);
    const Real far = GENERATE(0.0, 1.0 / 3, -1.1e7, 1e39, -1e200);
    CAPTURE(size, far);
    DynamicTree tree;
    std::vector<Aabb> boxes;
    std::vector<int> leaves;
    for (int i = 0; i < 8; ++i) {
        const Vec3 at = Vec3(far, -far, far) + size / 3 * Vec3(i, 2 * i, -i);
        boxes.push_back({at, at + Vec3::Constant(size)});
        leaves.push_back(tree.insert(boxes.back(), i));
    }
    tree.rebuild();
    for (const Aabb& box : boxes) CHECK(found(tree, {box.hi, box.hi}) == brute_force(boxes, {box.hi, box.hi}));
    // Boxes that shrink do not wear the copy out.
    for (int i = 0; i < 8; ++i) {
        boxes[i].hi = 0.5 * boxes[i].lo + 0.5 * boxes[i].hi;
        tree.shrink_box(leaves[i], boxes[i]);
    }
    for (const Aabb& box : boxes) CHECK(found(tree, {box.hi, box.hi}) == brute_force(boxes, {box.hi, box.hi}));
}

TEST_CASE("a tree whose boxes move together is not worn out, one whose boxes change places is") {
    DynamicTree tree;
    std::vector<int> leaves;
    const auto place = [](int i) { return Vec3(i % 10, i / 10 % 10, i / 100); };
    for (int i = 0; i < 1000; ++i) leaves.push_back(tree.insert(cube_at(place(i), 0.3), i));
    tree.rebuild();
    for (int i = 0; i < 1000; ++i) tree.set_box(leaves[i], cube_at(place(i) + Vec3(0, 0, -50), 0.3));
    CHECK(tree.refit_all());
    CHECK(found(tree, cube_at(place(555) + Vec3(0, 0, -50), 0.1)) == std::vector<int>{555});
    CHECK(found(tree, cube_at(place(555), 0.1)).empty());
    for (int i = 0; i < 1000; ++i) tree.set_box(leaves[i], cube_at(place(i * 367 % 1000), 0.3));
    CHECK_FALSE(tree.refit_all());
    CHECK(found(tree, cube_at(place(367), 0.1)) == std::vector<int>{1});
}

// Without rotations a row of boxes would make a chain as high as the row is long; twelve levels would hold 4096 of them.
TEST_CASE("boxes that come in a row, or all at one place, do not make a chain") {
    const bool row = GENERATE(true, false);
    CAPTURE(row);
    DynamicTree tree;
    for (int i = 0; i < 4000; ++i) tree.insert(cube_at(Vec3(row ? i : 0, 0, 0), 0.4), i);
    CHECK(tree.height() < 40);
    CHECK(found(tree, cube_at(Vec3::Zero(), 1e5)).size() == 4000);
    tree.rebuild();
    CHECK(tree.height() < 20);
    CHECK(found(tree, cube_at(Vec3::Zero(), 1e5)).size() == 4000);
}

TEST_CASE("boxes nested a thousandfold are found, however high their tree") {
    DynamicTree tree;
    std::vector<Aabb> boxes;
    for (int i = 0; i < 900; ++i) {
        const int exponent = (i * 7) % 900 - 450;  // areas go as squares: 2^±900 is still a number
        boxes.push_back(cube_at(Vec3::Zero(), std::ldexp(1.0, exponent)));
        tree.insert(boxes.back(), i);
    }
    CHECK(found(tree, cube_at(Vec3::Zero(), 0)).size() == 900);
    const Aabb part{Vec3::Constant(1), Vec3::Constant(2)};
    CHECK(found(tree, part) == brute_force(boxes, part));
    tree.rebuild();
    CHECK(found(tree, part) == brute_force(boxes, part));
}
