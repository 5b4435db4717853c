// Known bad cases of FCL and libccd, by the numbers of their reports where there are any.
#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

using namespace narrow_test;

namespace {

void check_face(const Outcome& o, const Vec3& n, Real separation, Real tolerance) {
    REQUIRE(o.manifolds.size() == 1);
    CHECK((o.manifolds[0].n - n).norm() < 1e-12);
    CHECK(deepest(o.manifolds[0]) == Approx(separation).margin(tolerance));
}

}  // namespace

TEST_CASE("fcl#545: a small cube deep in a corner of a big one leaves through a face, not along the diagonal") {
    const Shape big = cube_hull(Vec3(0.5, 0.5, 0.5)), small = cube_hull(Vec3(0.1, 0.1, 0.1)), small_box = Shape::box(Vec3(0.1, 0.1, 0.1));
    for (const Shape* s : {&small, &small_box}) {
        const Outcome o = collide(*s, at(0.4, 0.4, 0.4), big, at(0, 0, 0), 0.01);
        REQUIRE(o.manifolds.size() == 1);
        CHECK(o.manifolds[0].n.maxCoeff() == Approx(1));
        CHECK(deepest(o.manifolds[0]) == Approx(-0.2).margin(1e-9));
    }
}

TEST_CASE("fcl#375: shapes that just touch have a normal") {
    const Mat3 R = rotation(Vec3::UnitZ(), kPi / 2);
    check_face(collide(Shape::box(Vec3(0.245, 0.315, 0.0075)), at(0, -0.25, 0, R), Shape::cylinder(0.08, 0.001), at(0, 0, 0.0085), 1e-3),
               -Vec3::UnitZ(), 0, 1e-12);
    const Shape cube = cube_hull(Vec3(0.5, 0.5, 0.5)), box = Shape::box(Vec3(0.5, 0.5, 0.5));
    check_face(collide(cube, at(0, 0, 0), box, at(0.2, 0.1, 1), 1e-3), -Vec3::UnitZ(), 0, 1e-12);
    check_face(collide(cube, at(0, 0, 0), box, at(0, 0, 0.999), 1e-3), -Vec3::UnitZ(), -1e-3, 1e-12);
    check_face(collide(cube, at(0, 0, 0), cube, at(0, 0, 1), 1e-3), -Vec3::UnitZ(), 0, 1e-12);
}

TEST_CASE("coincident cubes leave through a face") {
    const Shape cube = cube_hull(Vec3(0.5, 0.5, 0.5)), box = Shape::box(Vec3(0.5, 0.5, 0.5));
    for (const Shape* a : {&cube, &box})
        for (const Shape* b : {&cube, &box}) {
            const Outcome o = collide(*a, at(0, 0, 0), *b, at(0, 0, 0), 1e-3);
            REQUIRE(o.manifolds.size() == 1);
            CHECK(deepest(o.manifolds[0]) == Approx(-1).margin(1e-9));
        }
}

TEST_CASE("fcl#544: capsules that nearly touch have the right sign") {
    const Shape c = Shape::capsule(0.3, 0.5);
    for (const Real gap : {-0.01, -1e-9, 0.0, 1e-9, 0.01}) {
        const Outcome o = collide(c, at(0.6 + gap, 0, 0), c, at(0, 0, 0), 0.1);
        REQUIRE(o.manifolds.size() == 1);
        CHECK((o.manifolds[0].n - Vec3::UnitX()).norm() < 1e-14);
        CHECK(deepest(o.manifolds[0]) == Approx(gap).margin(1e-15));
    }
}

TEST_CASE("fcl#493 and drake#18704: boxes on which the expanding polytope throws") {
    const Shape box = Shape::box(Vec3(0.25, 0.25, 0.25)), hull = cube_hull(Vec3(0.25, 0.25, 0.25));
    Mat3 R;
    R << 0.96193976625564348026, 0.15401279915737359216, 0.22572537250328919556, -0.19134171618254486313, 0.96936494951283913579,
        0.15401279915737359216, -0.19509032201612822033, -0.19134171618254486313, 0.96193976625564348026;
    const Transform X_A(R, Vec3(2.0770063995786869349, 0.48468247475641951239, 1.1543291419087275962)), X_B(R, Vec3(2, 0, 1.25));
    for (const Shape* a : {&box, &hull}) {
        const Outcome o = collide(*a, X_A, hull, X_B, 0.01);
        CHECK(o.stats.failures == 0);
        REQUIRE(o.manifolds.size() == 1);
        CHECK(o.manifolds[0].count == 4);
        CHECK(deepest(o.manifolds[0]) == Approx(0).margin(1e-9));
    }
    Mat3 Q;
    Q << 0.99983216350830295127, 0.017302258779861117571, 0.0060230104948389619895, -0.017255387167394182352, 0.99982108658241231058,
        -0.0077489637287346464937, -0.0061560474731557591632, 0.007643733791746519686, 0.9999518372930324972;
    const Transform X_C(Q, Vec3(0.85626818476862631702, -0.77764714060125894601, 0.070907056388150049853)),
        X_D(Mat3::Identity(), Vec3(0.85626818476862631702 - 0.3, -0.77764714060125894601, 0.0709));
    const Shape wall = cube_hull(Vec3(0.15, 0.15, 0.15));
    const Outcome o = collide(wall, X_C, wall, X_D, 0.01);
    REQUIRE(o.manifolds.size() == 1);
    CHECK(deepest(o.manifolds[0]) == Approx(-0.0034723).margin(1e-6));
}

TEST_CASE("a cube on and in a plate of 10 x 10 x 0.001 leaves across the plate") {
    const Shape plate = Shape::box(Vec3(5, 5, 0.0005)), cube = cube_hull(Vec3(0.5, 0.5, 0.5));
    check_face(collide(cube, at(3, 2, 0.5), plate, at(0, 0, 0), 1e-3), Vec3::UnitZ(), -0.0005, 1e-9);
    check_face(collide(cube, at(3, 2, 0.1), plate, at(0, 0, 0), 1e-3), Vec3::UnitZ(), -0.4005, 1e-6);
    check_face(collide(cube, at(3, 2, -0.01), plate, at(0, 0, 0), 1e-3), -Vec3::UnitZ(), -0.4905, 1e-6);
    check_face(collide(Shape::box(Vec3(0.5, 0.5, 0.5)), at(3, 2, 0.1), plate, at(0, 0, 0), 1e-3), Vec3::UnitZ(), -0.4005, 1e-12);
}

TEST_CASE("a hull on ground of 10 km lies on it") {
    const Shape ground = Shape::box(Vec3(5e3, 5e3, 0.5)), cube = cube_hull(Vec3(0.5, 0.5, 0.5));
    check_face(collide(cube, at(4e3, 3e3, 0.99), ground, at(0, 0, 0), 1e-3), Vec3::UnitZ(), -0.01, 1e-9);
}

TEST_CASE("aligned and degenerate poses of hulls neither fail nor give a wrong depth") {
    // Quarter turns, halves of the size, and noise from none to 1e-7: where GJK and the polytope meet coplanar points.
    const Shape cube = cube_hull(Vec3(0.5, 0.5, 0.5)), hexagon = prism(6, 0.6, 0.5), cylinder = Shape::cylinder(0.5, 0.5);
    const Shape* shapes[] = {&cube, &hexagon, &cylinder};
    Random r(1);
    const Real noise[] = {0, 1e-16, 1e-12, 1e-9, 1e-7};
    for (int i = 0; i < 3000; ++i) {
        CAPTURE(i);
        const auto turn = [&] {
            Vec3 axis = Vec3::Zero();
            axis[static_cast<int>(uniform(r, 0, 2.999))] = 1;
            return Mat3(rotation(axis, kPi / 4 * std::floor(uniform(r, 0, 8))) * rotation(random_direction(r), noise[i % 5]));
        };
        const auto step = [&] { return 0.25 * std::floor(uniform(r, -3, 4)); };
        const Transform X_A(turn(), Vec3(step(), step(), step())), X_B(turn(), noise[i % 5] * random_direction(r));
        const Shape &a = *shapes[i % 3], &b = *shapes[(i / 3) % 3];
        const Outcome o = collide(a, X_A, b, X_B, 0.01);
        REQUIRE(o.result != NarrowResult::kFailed);
        REQUIRE(flaw(o, 0.01, 1) == "");
        Real best = -1e300;  // a lower bound of the truth: a few directions
        for (const Mat3& R : {X_A.R, X_B.R})
            for (int k = 0; k < 3; ++k)
                for (const Real s : {-1.0, 1.0}) best = std::max(best, separation_along(a, X_A, b, X_B, s * R.col(k)));
        if (o.result == NarrowResult::kTouching) CHECK(deepest(o.manifolds[0]) > best - 0.02 * std::abs(best) - 2e-4);
        if (o.result == NarrowResult::kSeparated) CHECK(o.cache.is_apart());
    }
}
