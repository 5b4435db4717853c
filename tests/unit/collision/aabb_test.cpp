#include "collision/aabb.hpp"

#include "collision/shape.hpp"
#include "tests/support/catch.hpp"

#include <random>
#include <stdexcept>

using namespace cairn;

namespace {

const std::vector<Vec3> kPoints = {Vec3(0, 0, 0), Vec3(1, 0.2, 0), Vec3(0.1, 1, 0.3), Vec3(0.2, -0.1, 1.4), Vec3(1, 1, 1)};
const std::vector<std::array<int, 3>> kTriangles = {{0, 1, 2}, {1, 3, 2}, {1, 4, 3}};

Real sign(Real x) {
    return x < 0 ? -1 : 1;
}

// The point of the shape farthest along the unit vector d, both in the shape's frame.
Vec3 support(const Shape& s, const Vec3& d) {
    const Real up = sign(d.z()) * s.half_height;
    switch (s.type) {
        case ShapeType::kSphere:
            return s.radius * d;
        case ShapeType::kBox:
            return s.half_extents.cwiseProduct(Vec3(sign(d.x()), sign(d.y()), sign(d.z())));
        case ShapeType::kCapsule:
            return Vec3(0, 0, up) + s.radius * d;
        case ShapeType::kCylinder: {
            const Real across = std::hypot(d.x(), d.y());
            const Vec3 rim = across > 0 ? Vec3(d.x() / across, d.y() / across, 0) : Vec3::UnitX();
            return Vec3(0, 0, up) + s.radius * rim;
        }
        default:
            break;
    }
    Vec3 best = kPoints[0];
    for (const Vec3& p : kPoints)
        if (p.dot(d) > best.dot(d)) best = p;
    return best;
}

Shape shape_of(ShapeType type) {
    switch (type) {
        case ShapeType::kSphere:
            return Shape::sphere(0.7);
        case ShapeType::kBox:
            return Shape::box(Vec3(0.2, 1.3, 0.6));
        case ShapeType::kCapsule:
            return Shape::capsule(0.3, 1.1);
        case ShapeType::kCylinder:
            return Shape::cylinder(0.9, 0.4);
        case ShapeType::kHull:
            return Shape::convex(kPoints);
        default:
            return Shape::triangle_mesh(kPoints, kTriangles);
    }
}

Quat some_rotation(int i, std::mt19937& random) {
    if (i == 0) return Quat::Identity();
    if (i == 1) return Quat(std::sqrt(0.5), std::sqrt(0.5), 0, 0);
    std::normal_distribution<Real> normal;
    const Real w = normal(random), x = normal(random), y = normal(random), z = normal(random);
    return Quat(w, x, y, z).normalized();
}

}  // namespace

TEST_CASE("the box of a shape touches its support points along the axes and holds all others") {
    const ShapeType type =
        GENERATE(ShapeType::kSphere, ShapeType::kBox, ShapeType::kCapsule, ShapeType::kCylinder, ShapeType::kHull, ShapeType::kMesh);
    CAPTURE(static_cast<int>(type));
    const Shape shape = shape_of(type);
    std::mt19937 random(6);
    // Coordinates up to 5, a handful of roundings of 5e-16 each.
    const Real rounding = 5e-15;
    for (int i = 0; i < 50; ++i) {
        const Transform X(Pose{some_rotation(i, random), Vec3(1, -2, 3)});
        const Aabb box = shape_aabb(shape, X);
        for (int k = 0; k < 3; ++k) {
            const Vec3 e = Vec3::Unit(k);
            CHECK(std::abs((X * support(shape, X.R.transpose() * e))[k] - box.hi[k]) < rounding);
            CHECK(std::abs((X * support(shape, -X.R.transpose() * e))[k] - box.lo[k]) < rounding);
        }
        for (int j = 0; j < 50; ++j) {
            const Vec3 d = some_rotation(j + 2, random) * Vec3::UnitX();
            const Vec3 p = X * support(shape, d);
            CHECK(box.grown(rounding).contains({p, p}));
        }
    }
}

TEST_CASE("the box of a plane is not to be asked for") {
    CHECK_THROWS_AS(shape_aabb(Shape::plane(Vec3::UnitZ(), 0), Transform()), std::logic_error);
}

TEST_CASE("boxes overlap when they share a point, swept ones hold both ends, merged ones hold both") {
    const Aabb a{Vec3(0, 0, 0), Vec3(1, 1, 1)};
    for (int k = 0; k < 3; ++k) {
        for (const Real side : {-1.0, 1.0}) {
            const Vec3 touching = side * Vec3::Unit(k), apart = 1.001 * touching;
            CHECK(a.overlaps({a.lo + touching, a.hi + touching}));
            CHECK_FALSE(a.overlaps({a.lo + apart, a.hi + apart}));
            const Aabb swept = a.swept(apart);
            CHECK((swept.contains(a) && swept.contains({a.lo + apart, a.hi + apart})));
            CHECK(swept.hi[k] - swept.lo[k] == Approx(2.001));
        }
    }
    const Aabb b{Vec3(-3, 0.5, 2), Vec3(-2, 0.6, 5)}, both = a.merged(b);
    CHECK((both.contains(a) && both.contains(b)));
    CHECK(both.half_area() == Approx(4 * 1 + 1 * 5 + 5 * 4));
    CHECK_FALSE(a.contains(a.grown(1e-9)));
}
