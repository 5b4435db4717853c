// Inside of the mesh contacts. Everything in the mesh's frame; the solid lies behind each triangle, and a triangle is never touched from
// behind. Edges where the surface is flat or hollow are no edges to a body that slides over them: contacts there take the normals of the
// triangles, so that there are no bumps.
#pragma once

#include "collision/mesh.hpp"
#include "collision/narrow_pair.hpp"

#include <vector>

namespace cairn::narrow {

// Manifolds beyond this number, the shallowest, are dropped.
constexpr int kMaxMeshManifolds = 16;

// Cluster keys: what stays the same while a body slides over the mesh.
std::uint32_t plane_key(const Vec3& normal, Real offset, Real size);          // of a flat region
std::uint32_t edge_key(const TriangleMesh& mesh, int triangle, int corners);  // of a corner or edge, bits as in nearest_on_triangle

// Edge k of a triangle, seen from it: what lies across.
struct MeshEdge {
    int neighbour = -1;
    bool is_ridge = true;      // borders and convex edges; false: flat or hollow
    Vec3 away = Vec3::Zero();  // in the neighbour's plane, out of it across the edge; zero at a border
};
MeshEdge mesh_edge(const TriangleMesh& mesh, int triangle, int k);

// Whether the surface about corner k of a triangle falls away from the plane across n there: a body may touch the corner along n.
bool is_summit(const TriangleMesh& mesh, int triangle, int k, const Vec3& n);

// The triangle as a face that clips.
void triangle_face(const TriangleMesh& mesh, int triangle, Face& face);

// The shape's face towards a triangle, if it has one there, and which of its edges crosses which side of the triangle where the face is
// lowest over the triangle; −1: none does.
struct OwnFace {
    const Face* face = nullptr;
    int edge = -1;
    int side = -1;
};

// Closest points of the shape's core (drawn in by `shrink`) and a triangle, and the corners of the triangle that span its nearest feature.
fcl_query::Answer closest_to_triangle(Query& q, Real shrink, const OwnFace& own, const Vec3 corner[3], const Vec3& normal,
                                      fcl_query::Closest& closest, int& corners);

// What a shape reaches along its own axes, with the margin.
struct SolidReach {
    Mat3 to_local;
    Vec3 lo, hi;
    SolidReach(const PlacedShape& a, Real margin);
};

// `triangles`: those near the shape, ascending. Append manifolds in the mesh's frame to q.out.
NarrowResult collide_sphere_with_mesh(Query& q, const TriangleMesh& mesh, const std::vector<int>& triangles);
NarrowResult collide_solid_with_mesh(Query& q, const TriangleMesh& mesh, const SolidReach& reach, const std::vector<int>& triangles);

}  // namespace cairn::narrow
