#include "apps/cli/rivals/ode_shapes.hpp"

#include "collision/hull.hpp"
#include "collision/mesh.hpp"

namespace cairn::cli {

OdeShapes::~OdeShapes() {
    for (const dTriMeshDataID mesh : meshes_) dGeomTriMeshDataDestroy(mesh);
}

dGeomID OdeShapes::add_hull(dSpaceID space, const Shape& s) {
    Arrays& a = arrays_.emplace_back();
    for (const Vec3& v : s.hull->vertices()) a.points.insert(a.points.end(), {v.x(), v.y(), v.z()});
    for (const ConvexHull::Face& face : s.hull->faces()) {
        a.planes.insert(a.planes.end(), {face.normal.x(), face.normal.y(), face.normal.z(), face.offset});
        a.loops.push_back(static_cast<unsigned>(face.count));
        for (int k = 0; k < face.count; ++k) {
            a.loops.push_back(static_cast<unsigned>(s.hull->loop()[static_cast<std::size_t>(face.first + k)]));
        }
    }
    return dCreateConvex(space, a.planes.data(), static_cast<unsigned>(s.hull->faces().size()), a.points.data(),
                         static_cast<unsigned>(s.hull->vertices().size()), a.loops.data());
}

dGeomID OdeShapes::add_mesh(dSpaceID space, const Shape& s) {
    Arrays& a = arrays_.emplace_back();
    for (const Vec3& v : s.mesh->vertices()) a.points.insert(a.points.end(), {v.x(), v.y(), v.z()});
    for (const std::array<int, 3>& t : s.mesh->triangles()) a.triangles.insert(a.triangles.end(), t.begin(), t.end());
    meshes_.push_back(dGeomTriMeshDataCreate());
    const auto build = sizeof(dReal) == 8 ? dGeomTriMeshDataBuildDouble : dGeomTriMeshDataBuildSingle;
    build(meshes_.back(), a.points.data(), 3 * sizeof(dReal), static_cast<int>(a.points.size() / 3), a.triangles.data(),
          static_cast<int>(a.triangles.size()), 3 * sizeof(int));
    return dCreateTriMesh(space, meshes_.back(), nullptr, nullptr, nullptr);
}

dGeomID OdeShapes::add(dSpaceID space, const Shape& s, const Pose& X_WB) {
    switch (s.type) {
        case ShapeType::kSphere:
            return dCreateSphere(space, s.radius);
        case ShapeType::kBox:
            return dCreateBox(space, 2 * s.half_extents.x(), 2 * s.half_extents.y(), 2 * s.half_extents.z());
        case ShapeType::kCapsule:
            return dCreateCapsule(space, s.radius, 2 * s.half_height);
        case ShapeType::kCylinder:
            return dCreateCylinder(space, s.radius, 2 * s.half_height);
        case ShapeType::kHull:
            return add_hull(space, s);
        case ShapeType::kMesh:
            return add_mesh(space, s);
        case ShapeType::kPlane: {
            const Vec3 n = X_WB.q * s.normal;
            return dCreatePlane(space, n.x(), n.y(), n.z(), s.offset + n.dot(X_WB.p));
        }
    }
    throw Unsupported("shape");
}

}  // namespace cairn::cli
