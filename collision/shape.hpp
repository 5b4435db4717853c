// Collision shapes: plain values, validated where they are made. A body owns a list of them, each with its pose in the body frame.
#pragma once

#include "engine/base/math.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cairn {

class ConvexHull;    // collision/hull.hpp
class TriangleMesh;  // collision/mesh.hpp

enum class ShapeType : std::uint8_t { kSphere, kBox, kCapsule, kCylinder, kHull, kPlane, kMesh };

// One collision shape. Only the fields its type names are meaningful. Lengths in m.
struct Shape {
    ShapeType type = ShapeType::kSphere;
    Pose X_BS;                               // pose of the shape in its body's frame (identity for planes: see `normal`)
    Real radius = 0;                         // sphere, capsule, cylinder
    Real half_height = 0;                    // capsule (of the straight part), cylinder; along the shape's z
    Vec3 half_extents = Vec3::Zero();        // box
    Vec3 normal = Vec3::UnitZ();             // plane: unit, body frame; solid where normal·x <= offset
    Real offset = 0;                         // plane
    std::shared_ptr<const ConvexHull> hull;  // convex hull (its points are in the shape's frame)
    std::shared_ptr<const TriangleMesh> mesh;

    // Makers. Each throws Error naming the value if it is not finite or out of range.
    static Shape sphere(Real radius, const Pose& X_BS = {});
    static Shape box(const Vec3& half_extents, const Pose& X_BS = {});
    static Shape capsule(Real radius, Real half_height, const Pose& X_BS = {});
    static Shape cylinder(Real radius, Real half_height, const Pose& X_BS = {});
    static Shape convex(const std::vector<Vec3>& points, const Pose& X_BS = {});
    static Shape plane(const Vec3& normal, Real offset);
    static Shape triangle_mesh(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles, const Pose& X_BS = {});

    // Planes and meshes have no inside volume and belong to static bodies only.
    bool is_static_only() const { return type == ShapeType::kPlane || type == ShapeType::kMesh; }
};

}  // namespace cairn
