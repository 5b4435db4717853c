#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

using namespace narrow_test;

namespace {

const Vec3 kUp = Vec3::UnitZ();
const Mat3 kLie = rotation(Vec3::UnitY(), kPi / 2);  // the axis along x

const Manifold& only(const Outcome& o) {
    REQUIRE(o.manifolds.size() == 1);
    return o.manifolds[0];
}

}  // namespace

TEST_CASE("a sphere's core is its centre, against everything") {
    const Shape ball = Shape::sphere(0.5);
    const Shape others[] = {Shape::sphere(1),         Shape::box(Vec3(1, 1, 1)), Shape::cylinder(1, 1),
                            cube_hull(Vec3(1, 1, 1)), Shape::plane(kUp, 1),      Shape::capsule(0.4, 0.6)};
    for (const Shape& other : others) {
        CAPTURE(static_cast<int>(other.type));
        for (const Real gap : {-0.3, -1e-3, 0.0, 0.02}) {
            const Outcome o = collide(ball, at(0, 0, 1.5 + gap), other, at(0, 0, 0), 0.1);
            const Manifold& m = only(o);
            CHECK(m.count == 1);
            CHECK((m.n - kUp).norm() < 1e-14);
            CHECK(m.points[0].radius_a == 0.5);
            CHECK((m.points[0].core_a - Vec3(0, 0, 1.5 + gap)).norm() < 1e-14);
            CHECK(m.points[0].separation == Approx(gap).margin(1e-14));
        }
    }
}

TEST_CASE("round partners keep a round core: a sphere's centre, a capsule's and a cylinder's axis") {
    const Shape ball = Shape::sphere(0.5);
    CHECK(only(collide(ball, at(0, 0, 1.4), Shape::sphere(1), at(0, 0, 0), 0.1)).points[0].core_b.norm() < 1e-14);
    const Manifold capsule = only(collide(ball, at(0.3, 0, 0.9), Shape::capsule(0.5, 1), at(0, 0, 0, kLie), 0.1));
    CHECK((capsule.points[0].core_b - Vec3(0.3, 0, 0)).norm() < 1e-14);
    CHECK(capsule.points[0].radius_b == 0.5);
    const Manifold cylinder = only(collide(ball, at(0.3, 0, 0.9), Shape::cylinder(0.5, 1), at(0, 0, 0, kLie), 0.1));
    CHECK((cylinder.points[0].core_b - Vec3(0.3, 0, 0)).norm() < 1e-14);
    CHECK(cylinder.points[0].radius_b == 0.5);
    CHECK(cylinder.points[0].separation == Approx(-0.1));
}

TEST_CASE("a sphere at a box's edge and corner has the direction to them") {
    const Shape ball = Shape::sphere(0.5), box = Shape::box(Vec3(1, 1, 1));
    const Manifold edge = only(collide(ball, at(1.3, 0, 1.4), box, at(0, 0, 0), 0.1));
    CHECK((edge.n - Vec3(0.6, 0, 0.8)).norm() < 1e-14);
    CHECK(edge.owner == NormalOwner::kNone);
    CHECK(edge.points[0].separation == Approx(0).margin(1e-14));
    const Manifold corner = only(collide(ball, at(1.1, 1.2, 1.2), cube_hull(Vec3(1, 1, 1)), at(0, 0, 0), 0.1));
    CHECK((corner.n - Vec3(1, 2, 2) / 3).norm() < 1e-9);
}

TEST_CASE("coincident centres and axes get a unit direction, the same every time") {
    const Shape ball = Shape::sphere(0.5), capsule = Shape::capsule(0.3, 0.5), cylinder = Shape::cylinder(0.4, 0.6),
                box = Shape::box(Vec3(1, 2, 3));
    const Shape* shapes[] = {&ball, &capsule, &cylinder, &box};
    for (const Shape* a : shapes)
        for (const Shape* b : shapes) {
            CAPTURE(static_cast<int>(a->type), static_cast<int>(b->type));
            const Outcome o = collide(*a, at(1, 2, 3), *b, at(1, 2, 3), 0.1), again = collide(*a, at(1, 2, 3), *b, at(1, 2, 3), 0.1);
            CHECK(flaw(o, 0.1, 10) == "");
            CHECK(o.result == NarrowResult::kTouching);
            CHECK(only(o).n == only(again).n);
            CHECK(deepest(only(o)) < 0);
        }
}

TEST_CASE("capsules: crossed, parallel, end to end") {
    const Shape c = Shape::capsule(0.3, 1);
    const Manifold crossed = only(collide(c, at(0.2, 0.1, 0.55, kLie), c, at(0, 0, 0, rotation(Vec3::UnitX(), kPi / 2)), 0.1));
    CHECK(crossed.count == 1);
    CHECK((crossed.n - kUp).norm() < 1e-14);
    CHECK(crossed.points[0].separation == Approx(-0.05));
    CHECK((crossed.points[0].core_a - Vec3(0, 0.1, 0.55)).norm() < 1e-14);

    for (const Real tilt : {0.0, 1e-9, 1e-6, 1e-4}) {
        const Manifold parallel = only(collide(c, at(0.5, 0, 0.59, rotation(Vec3::UnitY(), tilt) * kLie), c, at(0, 0, 0, kLie), 0.1));
        REQUIRE(parallel.count == 2);
        CHECK((parallel.n - kUp).norm() < 2 * tilt + 1e-14);
        for (int i = 0; i < 2; ++i) {
            CHECK(parallel.points[i].separation == Approx(-0.01).margin(2 * tilt + 1e-14));
            CHECK(parallel.points[i].radius_a == 0.3);
        }
        CHECK(std::abs(parallel.points[0].core_a.x() - parallel.points[1].core_a.x()) == Approx(1.5).margin(1e-3));
    }
    const Manifold ends = only(collide(c, at(0, 0, 2.59), c, at(0, 0, 0), 0.1));
    CHECK((ends.n - kUp).norm() < 1e-14);
    CHECK(ends.points[0].separation == Approx(-0.01));
}

TEST_CASE("a lying capsule has its two ends on a plane and a box, a standing one its lower end") {
    const Shape c = Shape::capsule(0.3, 1), box = Shape::box(Vec3(3, 3, 1)), hull = cube_hull(Vec3(3, 3, 1)), plane = Shape::plane(kUp, 1);
    for (const Shape* other : {&box, &hull, &plane}) {
        CAPTURE(static_cast<int>(other->type));
        for (const Real tilt : {0.0, 1e-9, 1e-5, -1e-3}) {
            const Manifold lying = only(collide(c, at(0.2, 0.1, 1.299, rotation(Vec3::UnitY(), tilt) * kLie), *other, at(0, 0, 0), 0.01));
            REQUIRE(lying.count == 2);
            CHECK((lying.n - kUp).norm() < 1e-14);
            CHECK(lying.owner == NormalOwner::kB);
            CHECK(std::abs(lying.points[0].core_a.x() - lying.points[1].core_a.x()) == Approx(2).margin(1e-5));
            for (int i = 0; i < 2; ++i) CHECK(lying.points[i].separation == Approx(-1e-3).margin(1.01 * std::abs(tilt) + 1e-14));
        }
        const Manifold standing = only(collide(c, at(0.2, 0.1, 2.299), *other, at(0, 0, 0), 0.01));
        CHECK(standing.count == 1);
        CHECK((standing.points[0].core_a - Vec3(0.2, 0.1, 1.299)).norm() < 1e-14);
    }
}

TEST_CASE("a capsule that overhangs a box has one point at its end and one at the edge") {
    const Shape c = Shape::capsule(0.3, 1), box = Shape::box(Vec3(1, 1, 1));
    const Manifold m = only(collide(c, at(0.7, 0, 1.299, kLie), box, at(0, 0, 0), 0.01));
    REQUIRE(m.count == 2);
    CHECK(std::min(m.points[0].core_a.x(), m.points[1].core_a.x()) == Approx(-0.3));
    CHECK(std::max(m.points[0].core_a.x(), m.points[1].core_a.x()) == Approx(1.0).margin(1e-4));
}

TEST_CASE("a lying cylinder has two points with cores on its axis, whatever its spin") {
    const Shape c = Shape::cylinder(0.3, 1), box = Shape::box(Vec3(3, 3, 1)), plane = Shape::plane(kUp, 1);
    for (const Shape* other : {&box, &plane}) {
        for (const Real spin : {0.0, 0.3, 2.0}) {
            const Manifold m = only(collide(c, at(0.2, 0.1, 1.299, kLie * rotation(kUp, spin)), *other, at(0, 0, 0), 0.01));
            REQUIRE(m.count == 2);
            CHECK((m.n - kUp).norm() < 1e-14);
            for (int i = 0; i < 2; ++i) {
                CHECK(m.points[i].radius_a == Approx(0.3));
                CHECK(m.points[i].core_a.z() == Approx(1.299));
                CHECK(m.points[i].separation == Approx(-1e-3).margin(1e-12));
            }
        }
    }
}

TEST_CASE("a standing cylinder's points are fixed in it while it turns and its features persist") {
    const Shape c = Shape::cylinder(0.3, 0.5), box = Shape::box(Vec3(3, 3, 1)), plane = Shape::plane(kUp, 1);
    for (const Shape* other : {&box, &plane}) {
        for (const Real spin : {0.0, 0.4, 1.0}) {
            const Transform X = at(0.2, 0.1, 1.499, rotation(kUp, spin));
            const Manifold m = only(collide(c, X, *other, at(0, 0, 0), 0.01));
            REQUIRE(m.count == 4);
            for (const ManifoldPoint& p : m.points) {
                const Vec3 local = X.to_local(p.core_a);
                CHECK(std::min(std::abs(local.x()), std::abs(local.y())) < 1e-12);  // on the axes of its frame
                CHECK(p.radius_a == 0);
            }
        }
    }
}

TEST_CASE("a tilted cylinder's deepest point is its lowest rim point, exactly, at every tilt and spin") {
    const Shape c = Shape::cylinder(0.3, 0.5), plane = Shape::plane(kUp, 0), box = Shape::box(Vec3(3, 3, 1));
    Random r(3);
    for (int i = 0; i < 300; ++i) {
        const Real tilt = uniform(r, 2e-3, kPi / 2);
        Transform X(rotation(kUp, uniform(r, -3, 3)) * rotation(Vec3::UnitX(), tilt) * rotation(kUp, uniform(r, -3, 3)), Vec3(0.1, 0.2, 0));
        X.p.z() = 0.3 * std::sin(tilt) + 0.5 * std::cos(tilt) - 1e-3;
        const Outcome o = collide(c, X, plane, at(0, 0, 0), 0.01);
        CHECK(flaw(o, 0.01, 10) == "");
        CHECK(deepest(only(o)) == Approx(-1e-3).margin(1e-12));
        X.p.z() += 1;
        CHECK(deepest(only(collide(c, X, box, at(0, 0, 0), 0.01))) == Approx(-1e-3).margin(1e-12));
    }
}

TEST_CASE("a small cylinder on a large one, or under it, has four points on the small one's rim") {
    const Shape large = Shape::cylinder(1, 0.2), small = Shape::cylinder(0.3, 0.2);
    for (const Real x : {0.0, 1e-5, 0.4}) {
        for (const bool small_above : {true, false}) {
            const Manifold m = small_above ? only(collide(small, at(x, 0, 0.399), large, at(0, 0, 0), 0.01))
                                           : only(collide(large, at(0, 0, 0.399), small, at(x, 0, 0), 0.01));
            REQUIRE(m.count == 4);
            for (const ManifoldPoint& p : m.points) {
                CHECK(Vec3(p.core_a - Vec3(x, 0, p.core_a.z())).norm() == Approx(0.3));
                CHECK(p.separation == Approx(-1e-3).margin(1e-12));
            }
        }
    }
}

TEST_CASE("cylinders stacked, side by side and crossed") {
    const Shape c = Shape::cylinder(0.5, 0.5);
    for (const Real tilt : {0.0, 1e-9, 1e-6, 1e-4}) {
        for (const Real x : {0.0, 0.1, 0.7}) {
            const Manifold m = only(collide(c, at(x, 0, 0.999, rotation(Vec3(1, 1, 0), tilt)), c, at(0, 0, 0), 0.01));
            CHECK(m.count == 4);
            CHECK((m.n - kUp).norm() < 1.01 * tilt + 1e-14);
            CHECK(m.owner != NormalOwner::kNone);
        }
    }
    const Manifold side = only(collide(c, at(0.2, 0, 0.999, kLie), c, at(0, 0, 0, kLie), 0.01));
    CHECK(side.count == 2);
    CHECK((side.n - kUp).norm() < 1e-9);
    const Manifold crossed = only(collide(c, at(0.1, 0, 0.999, kLie), c, at(0, 0.1, 0, rotation(Vec3::UnitX(), kPi / 2)), 0.01));
    CHECK(crossed.count == 1);
    CHECK((crossed.n - kUp).norm() < 1e-9);
    CHECK(crossed.points[0].separation == Approx(-1e-3).margin(1e-9));
    const Manifold on_cap = only(collide(c, at(0.1, 0, 0.999, kLie), c, at(0, 0, 0), 0.01));
    CHECK(on_cap.count == 2);
    CHECK((on_cap.n - kUp).norm() < 1e-14);
}
