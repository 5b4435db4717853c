#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

#include <algorithm>

using namespace narrow_test;

namespace {

const Vec3 kUp = Vec3::UnitZ();

std::vector<std::uint32_t> features(const Manifold& m) {
    std::vector<std::uint32_t> f;
    for (int i = 0; i < m.count; ++i) f.push_back(m.points[i].feature);
    std::sort(f.begin(), f.end());
    return f;
}

}  // namespace

TEST_CASE("a box flat on a box has the four corners of their overlap and the face's normal") {
    const Shape box = Shape::box(Vec3(0.5, 0.5, 0.5));
    const Outcome o = collide(box, at(0.2, 0.1, 0.999), box, at(0, 0, 0), 0.01);
    REQUIRE(o.manifolds.size() == 1);
    const Manifold& m = o.manifolds[0];
    REQUIRE(m.count == 4);
    CHECK((m.n - kUp).norm() < 1e-15);
    CHECK(m.owner != NormalOwner::kNone);
    Vec3 lo = m.points[0].core_a, hi = lo;
    for (const ManifoldPoint& p : m.points) {
        CHECK(p.separation == Approx(-1e-3).margin(1e-15));
        lo = lo.cwiseMin(p.core_a);
        hi = hi.cwiseMax(p.core_a);
    }
    CHECK((lo.head<2>() - Eigen::Vector2d(-0.3, -0.4)).norm() < 1e-14);
    CHECK((hi.head<2>() - Eigen::Vector2d(0.5, 0.5)).norm() < 1e-14);
}

TEST_CASE("a resting box tilted by a little either way keeps four points and a face's normal") {
    const Shape box = Shape::box(Vec3(0.5, 0.4, 0.5)), hull = cube_hull(Vec3(0.5, 0.4, 0.5)), plate = Shape::box(Vec3(5, 5, 0.5)),
                cylinder = Shape::cylinder(0.5, 0.5), plane = Shape::plane(kUp, 0.5);
    const Shape* pairs[][2] = {{&box, &box},        {&box, &plate}, {&hull, &box},   {&box, &hull},      {&hull, &hull},
                               {&cylinder, &plate}, {&box, &plane}, {&hull, &plane}, {&cylinder, &plane}};
    Random r(1);
    for (const auto& pair : pairs) {
        CAPTURE(static_cast<int>(pair[0]->type), static_cast<int>(pair[1]->type));
        for (int i = 0; i < 300; ++i) {
            const Real tilt = std::pow(10.0, uniform(r, -9, -4));
            const Transform X_B(random_rotation(r), Vec3(uniform(r, -3, 3), 1, 2));
            const Mat3 lean = rotation(Vec3(uniform(r, -1, 1), uniform(r, -1, 1), 0), tilt);
            // Offsets either at random or none at all, where the faces match.
            const Real x = i % 2 ? uniform(r, -0.3, 0.3) : 0, y = i % 2 ? uniform(r, -0.2, 0.2) : 0, yaw = i % 2 ? uniform(r, -3, 3) : 0;
            const Real gap = i % 3 == 0 ? 1e-3 : i % 3 == 1 ? -1e-3 : 0;
            const Transform X_A = X_B * at(x, y, 1 + gap, lean * rotation(kUp, yaw));
            const Outcome o = collide(*pair[0], X_A, *pair[1], X_B, 0.01);
            REQUIRE(o.manifolds.size() == 1);
            const Manifold& m = o.manifolds[0];
            REQUIRE(m.count == 4);
            REQUIRE(m.owner != NormalOwner::kNone);
            const Vec3 face = m.owner == NormalOwner::kA ? Vec3(X_A.R.col(2)) : Vec3(X_B.R.col(2));
            CHECK((m.n - face).norm() < 1e-14);
            for (const ManifoldPoint& p : m.points) CHECK(p.separation == Approx(gap).margin(2 * tilt + 1e-14));
        }
    }
}

TEST_CASE("features and the side that owns the normal persist while a tilted box slides and rocks") {
    const Shape box = Shape::box(Vec3(0.5, 0.4, 0.5));
    PairCache cache;
    std::vector<std::uint32_t> before;
    NormalOwner owner = NormalOwner::kNone;
    for (int i = 0; i < 300; ++i) {
        const Mat3 lean = rotation(Vec3(std::sin(0.7 * i), std::cos(0.3 * i), 0), 1e-6);
        const Transform X = at(0.1 + 5e-4 * i, 0.05 + 2e-4 * i, 1 - 1e-4, lean * rotation(kUp, 0.01));
        const Outcome o = collide(box, X, box, at(0, 0, 0), 0.01, cache);
        cache = o.cache;
        REQUIRE(o.manifolds.size() == 1);
        REQUIRE(o.manifolds[0].count == 4);
        if (i > 0) {
            CHECK(features(o.manifolds[0]) == before);
            CHECK(o.manifolds[0].owner == owner);
        }
        before = features(o.manifolds[0]);
        owner = o.manifolds[0].owner;
    }
}

TEST_CASE("planks crossed at right angles and tilted still have four points") {
    const Shape plank = Shape::box(Vec3(2, 0.2, 0.05));
    Random r(5);
    for (int i = 0; i < 100; ++i) {
        const Mat3 lean = rotation(Vec3(uniform(r, -1, 1), uniform(r, -1, 1), 0), std::pow(10.0, uniform(r, -9, -4)));
        const Outcome o = collide(plank, at(0.3, 0.1, 0.1 - 1e-4, lean * rotation(kUp, kPi / 2)), plank, at(0, 0, 0), 0.01);
        REQUIRE(o.manifolds.size() == 1);
        CHECK(o.manifolds[0].count == 4);
        CHECK(o.manifolds[0].owner != NormalOwner::kNone);
    }
}

TEST_CASE("crossed edges give one point on each, with the normal across both") {
    const Shape box = Shape::box(Vec3(0.5, 0.5, 0.5)), hull = cube_hull(Vec3(0.5, 0.5, 0.5));
    const Mat3 roll = rotation(Vec3::UnitX(), kPi / 4);
    const Real top = std::sqrt(0.5);
    for (const Real gap : {-0.01, 0.002}) {
        for (const Shape* a : {&box, &hull}) {
            const Outcome o = collide(*a, at(0.1, 0.07, 2 * top + gap, rotation(kUp, 1.2) * roll), box, at(0, 0, 0, roll), 0.01);
            REQUIRE(o.manifolds.size() == 1);
            const Manifold& m = o.manifolds[0];
            REQUIRE(m.count == 1);
            CHECK((m.n - kUp).norm() < 1e-12);
            CHECK(m.owner == NormalOwner::kNone);
            CHECK(m.points[0].separation == Approx(gap).margin(1e-12));
            CHECK(m.points[0].core_b.z() == Approx(top));
            CHECK(m.points[0].core_b.y() == Approx(0).margin(1e-12));
        }
    }
}

TEST_CASE("a corner over a face is the vertex and its foot on the face") {
    const Shape box = Shape::box(Vec3(0.5, 0.5, 0.5)), big = Shape::box(Vec3(5, 5, 0.5));
    const Mat3 R = Quat::FromTwoVectors(Vec3(1, 1, 1).normalized(), -kUp).toRotationMatrix();
    const Outcome o = collide(box, at(1, 2, 0.5 + std::sqrt(0.75) - 0.003, R), big, at(0, 0, 0), 0.001);
    REQUIRE(o.manifolds.size() == 1);
    const ManifoldPoint& p = o.manifolds[0].points[0];
    REQUIRE(o.manifolds[0].count == 1);
    CHECK(o.manifolds[0].owner == NormalOwner::kB);
    CHECK((p.core_a - Vec3(1, 2, 0.497)).norm() < 1e-12);
    CHECK((p.core_b - Vec3(1, 2, 0.5)).norm() < 1e-12);
}

TEST_CASE("separated shapes within the margin have points with their true distances, beyond it none") {
    const Shape box = Shape::box(Vec3(0.5, 0.5, 0.5)), hull = cube_hull(Vec3(0.5, 0.5, 0.5));
    for (const Shape* a : {&box, &hull}) {
        for (const Shape* b : {&box, &hull}) {
            CAPTURE(static_cast<int>(a->type), static_cast<int>(b->type));
            const Outcome face = collide(*a, at(0.1, 0, 3, rotation(kUp, 0.4)), *b, at(0, 0, 0), 5);
            REQUIRE(face.manifolds.size() == 1);
            CHECK(face.manifolds[0].count == 4);
            CHECK((face.manifolds[0].n - kUp).norm() < 1e-14);
            for (const ManifoldPoint& p : face.manifolds[0].points) CHECK(p.separation == Approx(2));
            // Corner to corner, (1, 2, 2)/3 apart by 3.
            const Outcome corner = collide(*a, at(2, 3, 3), *b, at(0, 0, 0), 5);
            REQUIRE(corner.manifolds.size() == 1);
            CHECK(corner.manifolds[0].count == 1);
            CHECK((corner.manifolds[0].n - Vec3(1, 2, 2) / 3).norm() < 1e-9);
            CHECK(corner.manifolds[0].points[0].separation == Approx(3));
            CHECK(collide(*a, at(2, 3, 3), *b, at(0, 0, 0), 2.999).result == NarrowResult::kSeparated);
        }
    }
}

TEST_CASE("a cached separating axis answers without FCL, and only while it separates") {
    const Shape box = Shape::box(Vec3(0.5, 0.5, 0.5)), hull = prism(6, 0.5, 0.5);
    for (const Shape* b : {&box, &hull}) {
        Outcome first = collide(box, at(0, 0, 1.5), *b, at(0, 0, 0), 0.1);
        CHECK(first.result == NarrowResult::kSeparated);
        REQUIRE(first.cache.is_apart());
        const Outcome again = collide(box, at(0.1, 0, 1.4), *b, at(0, 0, 0), 0.1, first.cache);
        CHECK(again.result == NarrowResult::kSeparated);
        CHECK(again.stats.separating_axis_hits == 1);
        CHECK(again.stats.fcl_calls == 0);
        const Outcome near = collide(box, at(0.1, 0, 1.05), *b, at(0, 0, 0), 0.1, first.cache);
        CHECK(near.result == NarrowResult::kTouching);
    }
}

TEST_CASE("a sphere of vertices on a plane has the lowest first and at most four") {
    Random r(8);
    const Shape hull = hull_of(r, 60, 0.5), plane = Shape::plane(kUp, 0);
    for (int i = 0; i < 500; ++i) {
        Transform X(random_rotation(r), Vec3(uniform(r, -2, 2), 0, 0));
        const Real depth = uniform(r, -0.01, 0.02);
        X.p.z() = support_of(hull, X, -kUp) - depth;
        const Outcome o = collide(hull, X, plane, at(0, 0, 0), 0.015);
        REQUIRE(o.manifolds.size() == 1);
        CHECK(flaw(o, 0.015, 2) == "");
        CHECK(deepest(o.manifolds[0]) == Approx(-depth).margin(1e-4 * 0.5));
        CHECK(o.manifolds[0].owner == NormalOwner::kB);
    }
}
