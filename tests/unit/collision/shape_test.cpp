#include "collision/shape.hpp"

#include "collision/hull.hpp"
#include "collision/mesh.hpp"
#include "engine/base/error.hpp"
#include "tests/support/catch.hpp"

#include <functional>
#include <limits>
#include <string>

using namespace cairn;

namespace {

constexpr Real kInf = std::numeric_limits<Real>::infinity();
const Real kNan = std::nan("");

std::string error_of(const std::function<void()>& make) {
    try {
        make();
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

}  // namespace

TEST_CASE("a shape holds what it was made from") {
    const Pose X{Quat(0, 1, 0, 0), Vec3(1, 2, 3)};
    const Shape capsule = Shape::capsule(0.1, 0.5, X);
    CHECK(capsule.type == ShapeType::kCapsule);
    CHECK(capsule.radius == 0.1);
    CHECK(capsule.half_height == 0.5);
    CHECK(capsule.X_BS.p == X.p);
    CHECK(capsule.X_BS.q.coeffs() == X.q.coeffs());
    CHECK_FALSE(capsule.is_static_only());

    CHECK(Shape::sphere(2).radius == 2);
    CHECK(Shape::box(Vec3(1, 2, 3)).half_extents == Vec3(1, 2, 3));
    CHECK(Shape::cylinder(2, 3).type == ShapeType::kCylinder);
    const Shape plane = Shape::plane(Vec3(0, 0, 1), -2);
    CHECK(plane.offset == -2);
    CHECK(plane.is_static_only());
    const Shape mesh = Shape::triangle_mesh({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}});
    CHECK(mesh.is_static_only());
    CHECK(mesh.mesh->triangles().size() == 1);
    CHECK(Shape::convex({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}).hull->faces().size() == 4);
}

TEST_CASE("a rotation that is nearly unit is made unit") {
    const Shape s = Shape::sphere(1, {Quat(1.0005, 0, 0, 0), Vec3::Zero()});
    CHECK(s.X_BS.q.coeffs() == Quat::Identity().coeffs());
}

TEST_CASE("a shape out of range is refused by the name of the value") {
    CHECK(error_of([] { Shape::sphere(-1); }) == "radius: -1, must be > 0");
    CHECK(error_of([] { Shape::sphere(0); }) == "radius: 0, must be > 0");
    CHECK(error_of([] { Shape::sphere(kInf); }) == "radius: inf, must be finite");
    CHECK(error_of([] { Shape::sphere(kNan); }).find("radius") == 0);
    CHECK(error_of([] { Shape::box(Vec3(1, -2, 3)); }) == "half_extents[1]: -2, must be > 0");
    CHECK(error_of([] { Shape::capsule(1, 0); }) == "half_height: 0, must be > 0");
    CHECK(error_of([] { Shape::cylinder(-3, 1); }) == "radius: -3, must be > 0");
    CHECK(error_of([] { Shape::plane(Vec3(0, 0, 2), 0); }) == "length of the plane normal: 2, must be 1");
    CHECK(error_of([] { Shape::plane(Vec3(0, kInf, 0), 0); }) == "plane normal[1]: inf, must be finite");
    CHECK(error_of([] { Shape::plane(Vec3(0, 0, 1), -kInf); }) == "plane offset: -inf, must be finite");
    CHECK(error_of([] { Shape::sphere(1, {Quat(2, 0, 0, 0), Vec3::Zero()}); }) == "norm of the shape rotation: 2, must be 1");
    CHECK(error_of([] { Shape::sphere(1, {Quat(kNan, 0, 0, 0), Vec3::Zero()}); }).find("norm of the shape rotation") == 0);
    CHECK(error_of([] { Shape::sphere(1, {Quat::Identity(), Vec3(0, 0, kInf)}); }) == "shape position[2]: inf, must be finite");
}
