// Laws of every pair, at random.
#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

#include <algorithm>
#include <limits>

using namespace narrow_test;

namespace {

std::vector<Shape> bounded_shapes(Real scale) {
    Random r(11);
    return {Shape::sphere(0.4 * scale),
            Shape::box(scale * Vec3(0.5, 0.4, 0.3)),
            Shape::capsule(0.3 * scale, 0.5 * scale),
            Shape::cylinder(0.5 * scale, 0.4 * scale),
            Shape::cylinder(0.6 * scale, 0.05 * scale),
            prism(6, 0.6 * scale, 0.5 * scale),
            hull_of(r, 32, 0.6 * scale),
            Shape::box(scale * Vec3(5, 4, 0.05))};
}

// The directions in which polyhedra can be closest when they overlap: face normals and crossed edges (Gottschalk 1996).
std::vector<Vec3> polyhedron_directions(const Shape& a, const Transform& X_A, const Shape& b, const Transform& X_B) {
    std::vector<Vec3> n, edges[2];
    const Shape* shapes[] = {&a, &b};
    const Transform* poses[] = {&X_A, &X_B};
    for (int i = 0; i < 2; ++i) {
        const Mat3& R = poses[i]->R;
        if (shapes[i]->type == ShapeType::kBox) {
            for (int k = 0; k < 3; ++k) {
                n.push_back(R.col(k));
                edges[i].push_back(R.col(k));
            }
            continue;
        }
        const ConvexHull& hull = *shapes[i]->hull;
        for (const ConvexHull::Face& f : hull.faces()) {
            n.push_back(R * f.normal);
            for (int k = 0; k < f.count; ++k)
                edges[i].push_back(
                    R *
                    (hull.vertices()[hull.loop()[f.first + (k + 1) % f.count]] - hull.vertices()[hull.loop()[f.first + k]]).normalized());
        }
    }
    for (const Vec3& u : edges[0])
        for (const Vec3& v : edges[1]) {
            const Vec3 w = u.cross(v);
            if (w.norm() > 1e-6) n.push_back(w.normalized());
        }
    const std::size_t count = n.size();
    for (std::size_t i = 0; i < count; ++i) n.push_back(-n[i]);
    return n;
}

// The largest separation along any of the directions: minus the least penetration.
Real best_separation(const Shape& a, const Transform& X_A, const Shape& b, const Transform& X_B, const std::vector<Vec3>& directions) {
    Real best = -std::numeric_limits<Real>::infinity();
    for (const Vec3& n : directions) best = std::max(best, separation_along(a, X_A, b, X_B, n));
    return best;
}

// A pose of A near touching B: overlapping by `depth` along a random direction, or resting on B's top.
Transform near_pose(Random& r, const Shape& a, const Shape& b, const Transform& X_B, Real depth, Real scale, bool resting) {
    Transform X(random_rotation(r), X_B.p);
    Vec3 u = random_direction(r);
    if (resting) {
        X.R = X_B.R * rotation(Vec3::UnitZ(), uniform(r, -3, 3)) * rotation(random_direction(r), std::pow(10.0, uniform(r, -9, -3)));
        u = X_B.R.col(2);
        X.p += X_B.R * (scale * Vec3(uniform(r, -0.3, 0.3), uniform(r, -0.3, 0.3), 0));
    }
    X.p -= (separation_along(a, X, b, X_B, u) + depth) * u;
    return X;
}

}  // namespace

TEST_CASE("every pair in any pose: sound manifolds, the same in either order, and no overlap missed") {
    const Real scale = GENERATE(1.0, 0.01, 1000.0);
    const std::vector<Shape> shapes = bounded_shapes(scale);
    CAPTURE(scale);
    std::uint64_t failures = 0, queries = 0;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        for (std::size_t j = 0; j < shapes.size(); ++j) {
            CAPTURE(i, j);
            Random r(100 * i + j);
            for (int k = 0; k < 400; ++k) {
                const Transform X_B(random_rotation(r), scale * Vec3(uniform(r, -3, 3), uniform(r, -3, 3), uniform(r, -3, 3)));
                const Real depth = scale * std::pow(10.0, uniform(r, -6, -0.5)) * (k % 4 == 0 ? -1 : 1);
                const Transform X_A = near_pose(r, shapes[i], shapes[j], X_B, depth, scale, k % 3 == 0);
                const Real margin = scale * (k % 2 == 0 ? 0.02 : 2);
                const Outcome o = collide(shapes[i], X_A, shapes[j], X_B, margin), other = collide(shapes[j], X_B, shapes[i], X_A, margin);
                CAPTURE(k);
                queries += 2;
                failures += o.stats.failures + other.stats.failures;
                if (o.result == NarrowResult::kFailed || other.result == NarrowResult::kFailed) continue;
                const std::string wrong = flaw(o, margin, 10 * scale);
                REQUIRE(wrong == "");
                REQUIRE(flaw(other, margin, 10 * scale) == "");
                if (o.result != NarrowResult::kTouching) {
                    // The cached axis proves it, or (spheres keep none) the sphere's distance does.
                    if (o.cache.is_apart())
                        CHECK(separation_along(shapes[i], X_A, shapes[j], X_B, X_A.R * o.cache.axis) > margin - 1e-9 * scale);
                    continue;
                }
                REQUIRE(other.result == NarrowResult::kTouching);
                const Manifold &m = o.manifolds[0], &f = other.manifolds[0];
                // Pairs of different types are answered in one order only: exactly the same, mirrored.
                if (shapes[i].type != shapes[j].type) {
                    REQUIRE(m.count == f.count);
                    CHECK(m.n == -f.n);
                    for (int p = 0; p < m.count; ++p) {
                        CHECK(m.points[p].core_a == f.points[p].core_b);
                        CHECK(m.points[p].core_b == f.points[p].core_a);
                        CHECK(m.points[p].separation == f.points[p].separation);
                        CHECK(m.points[p].feature == f.points[p].feature);
                    }
                } else {
                    CHECK(deepest(m) == Approx(deepest(f)).epsilon(0.05).margin(5e-4 * scale));
                }
            }
        }
    }
    CAPTURE(queries);
    CHECK(failures == 0);
}

TEST_CASE("the depth of overlapping polyhedra is the least over all faces and crossed edges") {
    const std::vector<Shape> all = bounded_shapes(1);
    const std::vector<Shape> shapes = {all[1], all[5], all[7], cube_hull(Vec3(0.5, 0.5, 0.5)),
                                       hull_of(*std::make_unique<Random>(4), 10, 0.6)};
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        for (std::size_t j = 0; j < shapes.size(); ++j) {
            CAPTURE(i, j);
            Random r(7 * i + j);
            for (int k = 0; k < 150; ++k) {
                const Transform X_B(random_rotation(r), Vec3(uniform(r, -3, 3), uniform(r, -3, 3), uniform(r, -3, 3)));
                Transform X_A = near_pose(r, shapes[i], shapes[j], X_B, std::pow(10.0, uniform(r, -4, -0.5)), 1, k % 4 == 0);
                const std::vector<Vec3> directions = polyhedron_directions(shapes[i], X_A, shapes[j], X_B);
                const Real truth = best_separation(shapes[i], X_A, shapes[j], X_B, directions);
                if (truth >= 0) continue;
                const Outcome o = collide(shapes[i], X_A, shapes[j], X_B, 1e-3);
                REQUIRE(o.result == NarrowResult::kTouching);
                // FCL prefers faces until an edge is 5 % shallower; a face near FCL's direction stands in for it within 2e-4 of the size
                // (5 for the plate, else below 1).
                const Real size = std::min(i == 2 ? 6.5 : 0.8, j == 2 ? 6.5 : 0.8);
                CHECK(deepest(o.manifolds[0]) == Approx(truth).epsilon(0.055).margin(3.2e-4 * size));
            }
        }
    }
}

TEST_CASE("poses that are not finite fail, and nothing is appended") {
    const std::vector<Shape> shapes = bounded_shapes(1);
    const Real nan = std::numeric_limits<Real>::quiet_NaN(), inf = std::numeric_limits<Real>::infinity();
    for (const Shape& a : shapes)
        for (const Shape& b : shapes)
            for (const Real bad : {nan, inf}) {
                Transform X = at(0, 0, 0.3);
                X.p.x() = bad;
                CHECK(collide(a, X, b, at(0, 0, 0), 0.1).result == NarrowResult::kFailed);
                const Outcome o = collide(a, at(0, 0, 0), b, X, 0.1);
                CHECK(o.result == NarrowResult::kFailed);
                CHECK(o.manifolds.empty());
                CHECK(o.stats.failures == 1);
                X = at(0, 0, 0.3);
                X.R(1, 2) = bad;
                CHECK(collide(a, X, b, at(0, 0, 0), 0.1).result == NarrowResult::kFailed);
            }
}

TEST_CASE("far from the origin a contact is as exact as the coordinates") {
    const Shape hull = cube_hull(Vec3(0.5, 0.5, 0.5)), box = Shape::box(Vec3(0.5, 0.5, 0.5));
    for (const Shape* a : {&hull, &box}) {
        const Outcome o = collide(*a, at(1e6 + 0.25, 0.125, 0.9921875), box, at(1e6, 0, 0), 0.01);
        REQUIRE(o.manifolds.size() == 1);
        CHECK(o.manifolds[0].count == 4);
        CHECK((o.manifolds[0].n - Vec3::UnitZ()).norm() < 1e-14);
        for (const ManifoldPoint& p : o.manifolds[0].points) CHECK(p.separation == Approx(-0.0078125).margin(1e-14));
    }
}
