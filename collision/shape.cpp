#include "collision/shape.hpp"

#include "collision/hull.hpp"
#include "collision/mesh.hpp"
#include "engine/base/error.hpp"

#include <string>
#include <utility>

namespace cairn {
namespace {

constexpr Real kUnitTolerance = 1e-3;  // how far from unit length a rotation may be; it is normalised then

void check_positive(const std::string& what, Real value) {
    if (!std::isfinite(value)) throw_invalid(what, value, "finite");
    if (!(value > 0)) throw_invalid(what, value, "> 0");
}

void check_finite(const std::string& what, const Vec3& v) {
    for (int k = 0; k < 3; ++k)
        if (!std::isfinite(v[k])) throw_invalid(what + "[" + std::to_string(k) + "]", v[k], "finite");
}

Pose checked(const Pose& X_BS) {
    check_finite("shape position", X_BS.p);
    const Real norm = X_BS.q.norm();
    if (!(std::abs(norm - 1) <= kUnitTolerance)) throw_invalid("norm of the shape rotation", norm, "1");
    return {X_BS.q.normalized(), X_BS.p};
}

Shape make(ShapeType type, const Pose& X_BS) {
    Shape shape;
    shape.type = type;
    shape.X_BS = checked(X_BS);
    return shape;
}

}  // namespace

Shape Shape::sphere(Real radius, const Pose& X_BS) {
    check_positive("radius", radius);
    Shape shape = make(ShapeType::kSphere, X_BS);
    shape.radius = radius;
    return shape;
}

Shape Shape::box(const Vec3& half_extents, const Pose& X_BS) {
    for (int k = 0; k < 3; ++k) check_positive("half_extents[" + std::to_string(k) + "]", half_extents[k]);
    Shape shape = make(ShapeType::kBox, X_BS);
    shape.half_extents = half_extents;
    return shape;
}

Shape Shape::capsule(Real radius, Real half_height, const Pose& X_BS) {
    check_positive("radius", radius);
    check_positive("half_height", half_height);
    Shape shape = make(ShapeType::kCapsule, X_BS);
    shape.radius = radius;
    shape.half_height = half_height;
    return shape;
}

Shape Shape::cylinder(Real radius, Real half_height, const Pose& X_BS) {
    check_positive("radius", radius);
    check_positive("half_height", half_height);
    Shape shape = make(ShapeType::kCylinder, X_BS);
    shape.radius = radius;
    shape.half_height = half_height;
    return shape;
}

Shape Shape::convex(const std::vector<Vec3>& points, const Pose& X_BS) {
    Shape shape = make(ShapeType::kHull, X_BS);
    shape.hull = std::make_shared<const ConvexHull>(points);
    return shape;
}

Shape Shape::plane(const Vec3& normal, Real offset) {
    check_finite("plane normal", normal);
    if (!std::isfinite(offset)) throw_invalid("plane offset", offset, "finite");
    const Real norm = normal.norm();
    if (!(std::abs(norm - 1) <= kUnitTolerance)) throw_invalid("length of the plane normal", norm, "1");
    Shape shape = make(ShapeType::kPlane, {});
    shape.normal = normal / norm;
    shape.offset = offset;
    return shape;
}

Shape Shape::triangle_mesh(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles, const Pose& X_BS) {
    Shape shape = make(ShapeType::kMesh, X_BS);
    shape.mesh = std::make_shared<const TriangleMesh>(std::move(vertices), std::move(triangles));
    return shape;
}

}  // namespace cairn
