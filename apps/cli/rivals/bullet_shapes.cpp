#include "apps/cli/rivals/bullet_shapes.hpp"

#include "collision/hull.hpp"
#include "collision/mesh.hpp"

#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>

namespace cairn::cli {

namespace {

// Bullet rolls a sphere of its margin over a hull, which grows it. As its manual says, the faces are moved in by as much first; the margin
// is its default of 4 cm, or less for a hull so small that this would eat it.
std::unique_ptr<btCollisionShape> shrunk_hull(const ConvexHull& hull) {
    Vec3 low = hull.vertices().front(), high = low;
    std::vector<double> coordinates;
    for (const Vec3& v : hull.vertices()) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
        coordinates.insert(coordinates.end(), {v.x(), v.y(), v.z()});
    }
    const Real wanted = std::min(0.04, 0.05 * (high - low).minCoeff());
    btConvexHullComputer computer;
    const btScalar shrunk = computer.compute(coordinates.data(), 3 * sizeof(double), static_cast<int>(hull.vertices().size()),
                                             static_cast<btScalar>(wanted), btScalar(0.5));
    auto shape = std::make_unique<btConvexHullShape>();
    for (int i = 0; i < computer.vertices.size(); ++i) shape->addPoint(computer.vertices[i], false);
    shape->recalcLocalAabb();
    shape->setMargin(shrunk > 0 ? shrunk : static_cast<btScalar>(wanted));
    return shape;
}

}  // namespace

btCollisionShape* BulletShapes::keep(std::unique_ptr<btCollisionShape> shape) {
    shapes_.push_back(std::move(shape));
    return shapes_.back().get();
}

btCollisionShape* BulletShapes::add_one(const Shape& s) {
    const btScalar radius = static_cast<btScalar>(s.radius), half_height = static_cast<btScalar>(s.half_height);
    switch (s.type) {
        case ShapeType::kSphere:
            return keep(std::make_unique<btSphereShape>(radius));
        case ShapeType::kBox:
            return keep(std::make_unique<btBoxShape>(to_bullet(s.half_extents)));
        case ShapeType::kCapsule:
            return keep(std::make_unique<btCapsuleShapeZ>(radius, 2 * half_height));
        case ShapeType::kCylinder:
            return keep(std::make_unique<btCylinderShapeZ>(btVector3(radius, radius, half_height)));
        case ShapeType::kHull:
            return keep(shrunk_hull(*s.hull));
        case ShapeType::kPlane:
            return keep(std::make_unique<btStaticPlaneShape>(to_bullet(s.normal), static_cast<btScalar>(s.offset)));
        case ShapeType::kMesh: {
            auto mesh = std::make_unique<btTriangleMesh>(true, false);
            const std::vector<Vec3>& v = s.mesh->vertices();
            for (const std::array<int, 3>& t : s.mesh->triangles()) {
                mesh->addTriangle(to_bullet(v[static_cast<std::size_t>(t[0])]), to_bullet(v[static_cast<std::size_t>(t[1])]),
                                  to_bullet(v[static_cast<std::size_t>(t[2])]));
            }
            meshes_.push_back(std::move(mesh));
            return keep(std::make_unique<btBvhTriangleMeshShape>(meshes_.back().get(), true));
        }
    }
    throw Unsupported("shape");
}

btCollisionShape* BulletShapes::add(const std::vector<Shape>& shapes, const Quat& q_BP) {
    if (shapes.empty()) return keep(std::make_unique<btEmptyShape>());
    const bool turned = q_BP.vec().squaredNorm() > 0;
    const Shape& first = shapes.front();
    const bool centred = first.X_BS.p.isZero(0) && first.X_BS.q.vec().isZero(0) && !turned;
    if (shapes.size() == 1 && (centred || first.type == ShapeType::kPlane)) return add_one(first);
    auto compound = std::make_unique<btCompoundShape>();
    const Quat q_PB = q_BP.conjugate();
    for (const Shape& s : shapes) compound->addChildShape(to_bullet(Pose{q_PB, Vec3::Zero()} * s.X_BS), add_one(s));
    return keep(std::move(compound));
}

}  // namespace cairn::cli
