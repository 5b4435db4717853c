#include "collision/core_features.hpp"
#include "collision/narrow_mesh.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

#include <algorithm>

using namespace narrow_test;

namespace {

// Lower bound of the distance of the core and the triangle: what lies between planes across n.
Real gap_along(const PlacedShape& s, const fcl_query::Core& core, const Vec3 corner[3], const Vec3& n) {
    return -core_support(s, core, -n) - std::max({n.dot(corner[0]), n.dot(corner[1]), n.dot(corner[2])});
}

Vec3 random_point(Random& r, Real most) {
    const Real x = uniform(r, -most, most), y = uniform(r, -most, most), z = uniform(r, -most, most);
    return Vec3(x, y, z);
}

}  // namespace

// No distance is longer than that of two points, none shorter than the gap between planes: where both agree to 1e-7 of the size (GJK's
// tolerance is 1e-8), the answer is proven, whichever way it was found.
TEST_CASE("the nearest points of a shape and a triangle lie on both, and planes through them prove them") {
    constexpr Real kShrink = 0.05;
    Random r(11);
    const std::vector<Shape> shapes = {Shape::box(Vec3(0.5, 0.4, 0.3)), Shape::capsule(0.3, 0.5), prism(6, 0.5, 0.3), hull_of(r, 24, 0.5)};
    std::vector<Manifold> out;
    NarrowStats stats;
    int apart = 0;
    for (int round = 0; round < 4000; ++round) {
        const Shape& shape = shapes[static_cast<std::size_t>(round) % shapes.size()];
        CAPTURE(round);
        const Vec3 p = random_point(r, 0.5);
        const PlacedShape a{&shape, at(p.x(), p.y(), p.z() + 0.7, random_rotation(r))};
        Vec3 corner[3] = {random_point(r, 1), random_point(r, 1), random_point(r, 1)};
        for (Vec3& c : corner) c.z() *= 0.2;
        if ((corner[1] - corner[0]).cross(corner[2] - corner[0]).z() < 0) std::swap(corner[1], corner[2]);
        const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
        const Real size = shape_size(shape);
        narrow::Query query{a, {}, 1e3, size, Vec3::Zero(), false, false, false, out, stats};
        fcl_query::Core core;
        make_core(a, kShrink, core);
        fcl_query::Closest c;
        int corners = 0;
        if (narrow::closest_to_triangle(query, kShrink, {}, corner, normal, c, corners) != fcl_query::Answer::kApart) continue;
        ++apart;
        CHECK(c.distance == Approx((c.a - c.b).norm()).margin(1e-12));
        CHECK(gap_along(a, core, corner, c.n) > c.distance - 1e-7 * size);
        // The feature that is named holds the point.
        Vec3 nearest;
        const int touched = fcl_query::nearest_on_triangle(c.b, corner[0], corner[1], corner[2], nearest);
        CHECK((nearest - c.b).norm() < 1e-9);
        CHECK((corners & touched) != 0);
    }
    CHECK(apart > 2000);
}
