#include "collision/aabb.hpp"

#include "collision/hull.hpp"
#include "collision/mesh.hpp"
#include "collision/shape.hpp"

#include <stdexcept>

namespace cairn {
namespace {

Aabb about(const Vec3& centre, const Vec3& half) {
    return {centre - half, centre + half};
}

void include(Aabb& box, const Vec3& x) {
    box.lo = box.lo.cwiseMin(x);
    box.hi = box.hi.cwiseMax(x);
}

Aabb of_hull(const ConvexHull& hull, const Transform& X_WS) {
    const Aabb turned = hull.bounds(X_WS.R);
    return {turned.lo + X_WS.p, turned.hi + X_WS.p};
}

Aabb of_mesh(const TriangleMesh& mesh, const Transform& X_WS) {
    const Vec3 first = X_WS * mesh.vertices()[mesh.triangles()[0][0]];
    Aabb box{first, first};
    for (const std::array<int, 3>& t : mesh.triangles())
        for (const int i : t) include(box, X_WS * mesh.vertices()[i]);
    return box;
}

}  // namespace

Aabb shape_aabb(const Shape& shape, const Transform& X_WS) {
    const Vec3 axis = X_WS.R.col(2).cwiseAbs();
    switch (shape.type) {
        case ShapeType::kSphere:
            return about(X_WS.p, Vec3::Constant(shape.radius));
        case ShapeType::kBox:
            return about(X_WS.p, X_WS.R.cwiseAbs() * shape.half_extents);
        case ShapeType::kCapsule:
            return about(X_WS.p, shape.half_height * axis + Vec3::Constant(shape.radius));
        case ShapeType::kCylinder: {
            // A disc of radius r across the unit axis a reaches r √(1 − aᵢ²) along axis i; R's other two columns give that root
            // without cancellation.
            const Vec3 reach = X_WS.R.leftCols<2>().rowwise().norm();
            return about(X_WS.p, shape.half_height * axis + shape.radius * reach);
        }
        case ShapeType::kHull:
            return of_hull(*shape.hull, X_WS);
        case ShapeType::kMesh:
            return of_mesh(*shape.mesh, X_WS);
        case ShapeType::kPlane:
            break;
    }
    throw std::logic_error("shape_aabb: a plane has no bounding box");
}

}  // namespace cairn
