// Shapes as ODE has them.
#pragma once

#include "apps/cli/rivals/rival.hpp"
#include "collision/shape.hpp"

#include <ode/ode.h>

#include <deque>
#include <vector>

namespace cairn::cli {

// Makes geoms in a space and keeps the arrays that ODE's convex and mesh geoms only point to.
class OdeShapes {
public:
    ~OdeShapes();
    // The geom of a shape; not yet placed. Planes are given in the world, by the body's pose.
    dGeomID add(dSpaceID space, const Shape& shape, const Pose& X_WB);

private:
    struct Arrays {
        std::vector<dReal> planes, points;
        std::vector<unsigned> loops;
        std::vector<int> triangles;
    };
    dGeomID add_hull(dSpaceID space, const Shape& shape);
    dGeomID add_mesh(dSpaceID space, const Shape& shape);

    std::deque<Arrays> arrays_;  // addresses stay
    std::vector<dTriMeshDataID> meshes_;
};

}  // namespace cairn::cli
