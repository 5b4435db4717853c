// A pair that keeps touching with the same features is answered from its last contact, and as well as by asking anew.
#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

#include <limits>

using namespace narrow_test;

namespace {

std::vector<Shape> shapes() {
    Random r(5);
    return {Shape::box(Vec3(0.5, 0.4, 0.3)), Shape::capsule(0.3, 0.5), Shape::cylinder(0.5, 0.4), prism(6, 0.5, 0.4), hull_of(r, 24, 0.5),
            cube_hull(Vec3(0.3, 0.5, 0.4))};
}

// A placed so that its separation from B at the origin is `gap`, from a random side.
bool place(Random& r, const Shape& a, const Shape& b, Real gap, Transform& X_A) {
    X_A = {random_rotation(r), 3 * random_direction(r)};
    for (int i = 0; i < 3; ++i) {  // the closest features may change on the way
        const Outcome o = collide(a, X_A, b, Transform(), 10);
        if (o.manifolds.size() != 1) return false;
        X_A.p += (gap - deepest(o.manifolds[0])) * o.manifolds[0].n;
    }
    return true;
}

}  // namespace

TEST_CASE("a contact that moves on is answered from the last one as from the beginning") {
    Random r(17);
    const std::vector<Shape> list = shapes();
    int asked = 0, without_fcl = 0;
    for (int round = 0; round < 2000; ++round) {
        const Shape &a = list[r() % list.size()], &b = list[r() % list.size()];
        const Real gap = uniform(r, -0.003, 0.003), margin = 0.02;
        Transform X_A;
        if (!place(r, a, b, gap, X_A)) continue;
        const Outcome first = collide(a, X_A, b, Transform(), margin);
        if (first.manifolds.size() != 1) continue;
        const Transform moved(rotation(random_direction(r), uniform(r, 0, 0.003)) * X_A.R,
                              X_A.p + uniform(r, 0, 0.002) * random_direction(r));
        const Outcome warm = collide(a, moved, b, Transform(), margin, first.cache), cold = collide(a, moved, b, Transform(), margin);
        CAPTURE(round, static_cast<int>(a.type), static_cast<int>(b.type), gap);
        REQUIRE(flaw(warm, margin, 1) == "");
        REQUIRE(warm.manifolds.size() == 1);
        REQUIRE(cold.manifolds.size() == 1);
        ++asked;
        if (warm.stats.fcl_calls > 0) continue;
        ++without_fcl;
        // Disjoint shapes have one direction of least distance. Overlapping ones may have several that are nearly as good, and an overlap
        // of less than 0.005 of the size (1 at most) is not asked for the best. Points may tell a depth that is out by 5 % and 2e-4
        // (try_face).
        const Real truth = separation_along(a, moved, b, Transform(), cold.manifolds[0].n);
        const Real along = separation_along(a, moved, b, Transform(), warm.manifolds[0].n);
        CHECK(along > truth - (truth > 0 ? 1e-3 * truth + 1e-5 : 0.005));
        CHECK(std::abs(deepest(warm.manifolds[0]) - along) < 3e-4 + 0.05 * std::abs(along));
    }
    REQUIRE(asked > 1000);
    CHECK(without_fcl > asked / 10);
}

TEST_CASE("a pair whose features have changed is not answered from the last contact") {
    // A cube on a face; then turned onto an edge, and moved aside so that another face of the lower one is nearer.
    const Shape box = Shape::box(Vec3(0.5, 0.5, 0.5));
    const Outcome first = collide(box, at(0, 0, 0.999), box, at(0, 0, 0), 0.01);
    REQUIRE(first.manifolds.size() == 1);
    const Mat3 tilted = rotation(Vec3::UnitX(), kPi / 4);
    const Outcome edge = collide(box, at(0, 0, 0.5 + std::sqrt(0.5) - 0.001, tilted), box, at(0, 0, 0), 0.01, first.cache);
    REQUIRE(edge.manifolds.size() == 1);
    CHECK(edge.manifolds[0].count == 2);
    CHECK((edge.manifolds[0].n - Vec3::UnitZ()).norm() < 1e-9);
    const Outcome side = collide(box, at(0.999, 0, 0.4), box, at(0, 0, 0), 0.01, first.cache);
    REQUIRE(side.manifolds.size() == 1);
    CHECK((side.manifolds[0].n - Vec3::UnitX()).norm() < 1e-9);
}

TEST_CASE("crossed edges that were nearest are found to be so still, with the same manifold as from the beginning") {
    Random r(23);
    const Shape capsule = Shape::capsule(0.2, 0.6), box = Shape::box(Vec3(0.5, 0.6, 0.4));
    for (int round = 0; round < 200; ++round) {
        // The box on one of its edges, the capsule across that edge, near its middle.
        const Mat3 on_edge = rotation(Vec3::UnitX(), uniform(r, 0.6, 0.9)), lying = rotation(Vec3::UnitX(), kPi / 2);
        const Vec3 top = on_edge * Vec3(0, 0.6, 0.4);
        const Transform above(rotation(Vec3::UnitZ(), uniform(r, -0.3, 0.3)) * lying, top + Vec3(uniform(r, -0.2, 0.2), 0, 0.2));
        const Transform under(on_edge, Vec3::Zero());
        const Outcome first = collide(capsule, above, box, under, 0.02);
        REQUIRE(first.manifolds.size() == 1);
        const Transform moved(rotation(random_direction(r), 0.01) * above.R, above.p + 0.01 * random_direction(r));
        const Outcome warm = collide(capsule, moved, box, under, 0.02, first.cache), cold = collide(capsule, moved, box, under, 0.02);
        REQUIRE(warm.manifolds.size() == 1);
        REQUIRE(cold.manifolds.size() == 1);
        CHECK((warm.manifolds[0].n - cold.manifolds[0].n).norm() < 1e-9);
        CHECK(std::abs(deepest(warm.manifolds[0]) - deepest(cold.manifolds[0])) < 1e-9);
        CHECK((warm.manifolds[0].points[0].core_a - cold.manifolds[0].points[0].core_a).norm() < 1e-7);  // GJK's tolerance, amplified
    }
}

TEST_CASE("two spheres touch along their centres, at any distance of them") {
    Random r(3);
    const Shape a = Shape::sphere(0.5), b = Shape::sphere(0.2);
    for (int round = 0; round < 200; ++round) {
        const Vec3 d = random_direction(r);
        const Real gap = uniform(r, -0.69, 0.1);
        const Vec3 p(uniform(r, -9, 9), uniform(r, -9, 9), uniform(r, -9, 9));
        const Outcome o = collide(a, at(p.x(), p.y(), p.z()), b, {random_rotation(r), p - (0.7 + gap) * d}, 0.05);
        if (gap > 0.05) {
            CHECK(o.result == NarrowResult::kSeparated);
            continue;
        }
        REQUIRE(o.manifolds.size() == 1);
        // Coordinates up to 10: rounding of 1e-15 of them, against a distance of the centres of 0.01 at least.
        CHECK((o.manifolds[0].n - d).norm() < 1e-12);
        CHECK(std::abs(o.manifolds[0].points[0].separation - gap) < 1e-13);
        CHECK(flaw(o, 0.05, 10) == "");
    }
    const Outcome same = collide(a, at(1, 2, 3), b, at(1, 2, 3), 0.05);
    REQUIRE(same.manifolds.size() == 1);
    CHECK(same.manifolds[0].n.norm() == Approx(1));
    CHECK(collide(a, at(std::numeric_limits<Real>::quiet_NaN(), 0, 0), b, at(0, 0, 0), 0.05).result == NarrowResult::kFailed);
}
