#include "collision/extent.hpp"

#include "collision/hull.hpp"
#include "collision/shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn {

Real bounding_radius(const Shape& s) {
    const Real offset = s.X_BS.p.norm();
    switch (s.type) {
        case ShapeType::kSphere:
            return offset + s.radius;
        case ShapeType::kBox:
            return offset + s.half_extents.norm();
        case ShapeType::kCapsule:
            return offset + s.half_height + s.radius;
        case ShapeType::kCylinder:
            return offset + std::hypot(s.half_height, s.radius);
        case ShapeType::kHull:
            return offset + s.hull->outer_radius();
        default:
            return std::numeric_limits<Real>::infinity();
    }
}

Real least_extent(const Shape& s) {
    switch (s.type) {
        case ShapeType::kSphere:
        case ShapeType::kCapsule:
            return 2 * s.radius;
        case ShapeType::kCylinder:
            return 2 * std::min(s.radius, s.half_height);
        case ShapeType::kBox:
            return 2 * s.half_extents.minCoeff();
        case ShapeType::kHull:
            return 2 * s.hull->inner_radius();
        default:
            return std::numeric_limits<Real>::infinity();
    }
}

}  // namespace cairn
