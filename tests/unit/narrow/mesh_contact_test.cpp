#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

#include <algorithm>

using namespace narrow_test;

namespace {

const Vec3 kUp = Vec3::UnitZ();

Real flat(Real, Real) {
    return 0;
}
Real roof(Real x, Real) {
    return -std::abs(x);
}
// No two of its triangles lie in one plane.
Real rough_roof(Real x, Real y) {
    return -std::abs(x) * (1 + 0.1 * std::sin(7 * y + 2 * x));
}
Real valley(Real x, Real) {
    return std::abs(x);
}
Real hills(Real x, Real y) {
    return 0.05 * std::sin(x) * std::cos(0.7 * y);
}

std::vector<Shape> solids() {
    Random r(3);
    return {Shape::box(Vec3(0.5, 0.4, 0.3)), Shape::capsule(0.3, 0.5), Shape::cylinder(0.4, 0.3), prism(6, 0.5, 0.3), hull_of(r, 24, 0.5)};
}

}  // namespace

TEST_CASE("a ball that rolls over a flat grid has one point and the grid's normal, everywhere") {
    const Shape grid = grid_mesh(8, 0.25, flat);
    const Shape ball = Shape::sphere(0.2);
    Random r(1);
    std::uint32_t key = 0;
    for (int i = 0; i < 4000; ++i) {
        // Every other one exactly over an edge or a corner of the grid.
        Real x = uniform(r, -0.9, 0.9), y = uniform(r, -0.9, 0.9);
        if (i % 2 == 0) x = std::round(x / 0.25) * 0.25;
        if (i % 4 == 0) y = std::round(y / 0.25) * 0.25;
        const Real gap = i % 3 == 0 ? 1e-3 : -1e-3;
        const Outcome o = collide(ball, at(x, y, 0.2 + gap), grid, at(0, 0, 0), 0.05);
        REQUIRE(o.manifolds.size() == 1);
        const Manifold& m = o.manifolds[0];
        CHECK(m.count == 1);
        CHECK((m.n - kUp).norm() < 1e-14);
        CHECK(m.points[0].separation == Approx(gap).margin(1e-14));
        CHECK(m.points[0].radius_a == 0.2);
        if (i > 0) CHECK(m.sub_key == key);
        key = m.sub_key;
    }
}

TEST_CASE("whatever slides over a flat grid never sees a normal off the grid's") {
    const Shape grid = grid_mesh(8, 0.25, flat);
    for (const Shape& shape : solids()) {
        Random r(2);
        CAPTURE(static_cast<int>(shape.type));
        for (int i = 0; i < 500; ++i) {
            // Lying or standing with a slight tilt, or any way round with its lowest point just touching.
            Mat3 R = random_rotation(r);
            if (i % 2 == 0) R = rotation(kUp, uniform(r, -3, 3)) * rotation(random_direction(r), std::pow(10.0, uniform(r, -9, -3)));
            Transform X(R, Vec3::Zero());
            const Real depth = std::pow(10.0, uniform(r, -7, -2)) * (i % 3 == 0 ? -1 : 1);
            X.p = Vec3(uniform(r, -0.2, 0.2), uniform(r, -0.2, 0.2), support_of(shape, X, -kUp) - depth);
            const Outcome o = collide(shape, X, grid, at(0, 0, 0), 0.02);
            CHECK(flaw(o, 0.02, 1) == "");
            REQUIRE(o.manifolds.size() == 1);
            CHECK((o.manifolds[0].n - kUp).norm() < 1e-14);
            // Points up to 1e-4 of the size above the deepest count as equally deep, and the rim points of a cylinder that is tilted by
            // less than 1e-3 stand at fixed places, up to radius (1 − cos(π/32)) 1e-3 above the lowest.
            CHECK(deepest(o.manifolds[0]) == Approx(-depth).margin(1e-4));
        }
    }
}

TEST_CASE("a box that lies on a flat grid has the four points of its face, and keeps their features while it slides") {
    const Shape grid = grid_mesh(16, 0.25, flat);
    const Shape box = Shape::box(Vec3(0.5, 0.4, 0.3));
    std::vector<std::uint32_t> features;
    for (int i = 0; i < 200; ++i) {
        const Outcome o = collide(box, at(-1 + 0.01 * i, 0.003 * i, 0.3 - 1e-4, rotation(kUp, 0.3)), grid, at(0, 0, 0), 0.02);
        REQUIRE(o.manifolds.size() == 1);
        REQUIRE(o.manifolds[0].count == 4);
        CHECK(o.manifolds[0].owner == NormalOwner::kB);
        std::vector<std::uint32_t> now;
        for (const ManifoldPoint& p : o.manifolds[0].points) {
            now.push_back(p.feature);
            CHECK(p.separation == Approx(-1e-4).margin(1e-13));
        }
        std::sort(now.begin(), now.end());
        if (i > 0) CHECK(now == features);
        features = now;
    }
}

TEST_CASE("a box larger than the mesh's flat top rests on the corners of that top") {
    const Shape grid = grid_mesh(2, 0.25, flat);
    const Shape box = Shape::box(Vec3(1, 1, 0.3));
    const Outcome o = collide(box, at(0.1, 0, 0.3), grid, at(0, 0, 0), 0.02);
    REQUIRE(o.manifolds.size() == 1);
    REQUIRE(o.manifolds[0].count == 4);
    for (const ManifoldPoint& p : o.manifolds[0].points) CHECK(p.core_b.cwiseAbs().head<2>().isApprox(Eigen::Vector2d(0.25, 0.25)));
}

TEST_CASE("a mesh is not touched from behind") {
    const Shape grid = grid_mesh(8, 0.25, flat);
    CHECK(collide(Shape::sphere(0.2), at(0.1, 0, -0.25), grid, at(0, 0, 0), 0.02).manifolds.empty());
    for (const Shape& shape : solids()) {
        Transform X = at(0.1, 0.05, 0, rotation(Vec3(1, 2, 3), 1));
        X.p.z() = -support_of(shape, X, kUp) - 1e-3;
        CHECK(collide(shape, X, grid, at(0, 0, 0), 0.02).manifolds.empty());
    }
}

TEST_CASE("a ball in a valley touches both slopes, on a roof only the ridge") {
    const Real s = std::sqrt(0.5);
    const Outcome in = collide(Shape::sphere(0.2), at(0.01, 0.03, 0.2 / s - 1e-3), grid_mesh(4, 0.5, valley), at(0, 0, 0), 0.02);
    REQUIRE(in.manifolds.size() == 2);
    for (const Manifold& m : in.manifolds) CHECK(std::abs(m.n.x()) == Approx(s));
    const Outcome on = collide(Shape::sphere(0.2), at(0.01, 0.03, 0.199), grid_mesh(4, 0.5, roof), at(0, 0, 0), 0.02);
    REQUIRE(on.manifolds.size() == 1);
    CHECK(on.manifolds[0].owner == NormalOwner::kNone);
    CHECK((on.manifolds[0].n - Vec3(0.01, 0, 0.199).normalized()).norm() < 1e-12);
}

TEST_CASE("a box laid on a ridge rests on it with its own face's normal") {
    const Outcome o = collide(Shape::box(Vec3(0.5, 0.4, 0.3)), at(0.1, 0.03, 0.3 - 1e-3), grid_mesh(4, 0.5, roof), at(0, 0, 0), 0.02);
    REQUIRE(o.manifolds.size() == 1);
    CHECK((o.manifolds[0].n - kUp).norm() < 1e-12);
    CHECK(o.manifolds[0].count >= 2);
    CHECK(o.manifolds[0].owner == NormalOwner::kA);
    CHECK(deepest(o.manifolds[0]) == Approx(-1e-3).margin(1e-12));
}

// Across the ridge the capsule's axis lies over both slopes; nearly along it over neither, and one of the triangles alone is asked.
TEST_CASE("a capsule on a ridge touches it where its axis crosses it, whichever way it lies") {
    const Shape mesh = grid_mesh(8, 0.25, rough_roof);
    const Shape capsule = Shape::capsule(0.1, 0.3);
    Random r(7);
    for (int i = 0; i < 500; ++i) {
        const Real yaw = i % 2 == 0 ? uniform(r, -1, 1) : 0.5 * kPi - uniform(r, 0.1, 0.2), tilt = uniform(r, -0.05, 0.05);
        const Mat3 R = rotation(kUp, yaw) * rotation(Vec3::UnitY(), 0.5 * kPi + tilt);
        const Vec3 axis = R.col(2);
        Vec3 n = axis.cross(Vec3::UnitY()).normalized();
        if (n.z() < 0) n = -n;
        const Real gap = uniform(r, -1e-3, 1e-3);
        const Vec3 on_ridge(0, 0.25 * (std::floor(uniform(r, -2, 2)) + uniform(r, 0.1, 0.9)), 0);  // not where two of its edges meet
        const Vec3 p = on_ridge + (0.1 + gap) * n + uniform(r, -0.1, 0.1) * axis;
        const Outcome o = collide(capsule, at(p.x(), p.y(), p.z(), R), mesh, at(0, 0, 0), 0.02);
        CAPTURE(i, n.transpose());
        const auto crosses = [&](const Manifold& m) { return (m.n - n).norm() < 1e-6 && (m.points[0].core_b - on_ridge).norm() < 1e-5; };
        const auto found = std::find_if(o.manifolds.begin(), o.manifolds.end(), crosses);
        REQUIRE(found != o.manifolds.end());
        CHECK(found->count == 1);
        CHECK(found->points[0].separation == Approx(gap).margin(1e-6));
    }
}

TEST_CASE("a box between floor and wall touches each with its normal") {
    // An L of two quads: floor z = 0 for x < 0, wall x = 0 facing −x.
    const std::vector<Vec3> v = {{-2, -2, 0}, {0, -2, 0}, {0, 2, 0}, {-2, 2, 0}, {0, -2, 2}, {0, 2, 2}};
    const Shape room = Shape::triangle_mesh(v, {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}});
    const Outcome o = collide(Shape::box(Vec3(0.5, 0.4, 0.3)), at(-0.499, 0.1, 0.299), room, at(0, 0, 0), 0.02);
    REQUIRE(o.manifolds.size() == 2);
    CHECK((o.manifolds[0].n - kUp).norm() < 1e-14);
    CHECK((o.manifolds[1].n + Vec3::UnitX()).norm() < 1e-14);
    for (const Manifold& m : o.manifolds) CHECK(m.count == 4);
}

TEST_CASE("mesh contacts on rough ground are sound in any pose, in either order") {
    const Shape ground = grid_mesh(24, 0.25, hills);
    std::vector<Shape> shapes = solids();
    shapes.push_back(Shape::sphere(0.3));
    const Transform X_B = at(3, -2, 1, rotation(Vec3(1, 1, 0), 0.4));
    for (const Shape& shape : shapes) {
        CAPTURE(static_cast<int>(shape.type));
        Random r(4);
        int touching = 0;
        for (int i = 0; i < 600; ++i) {
            const Transform X = X_B * at(uniform(r, -2, 2), uniform(r, -2, 2), uniform(r, -0.2, 0.7), random_rotation(r));
            const Real margin = i % 3 == 0 ? 0.3 : 0.01;
            const Outcome o = collide(shape, X, ground, X_B, margin), flipped = collide(ground, X_B, shape, X, margin);
            CHECK(flaw(o, margin, 4) == "");
            CHECK(o.result == flipped.result);
            REQUIRE(o.manifolds.size() == flipped.manifolds.size());
            touching += o.result == NarrowResult::kTouching;
            for (std::size_t k = 0; k < o.manifolds.size(); ++k) {
                CHECK(o.manifolds[k].n.isApprox(-flipped.manifolds[k].n));
                // No slope is steeper than 0.05: a normal may lean out to the shape's own faces on a ridge, never sideways.
                CHECK((X_B.R.transpose() * o.manifolds[k].n).z() > 0.99);
            }
        }
        CHECK(touching > 200);
    }
}
