// How large a shape is [m]. Source: elementary.
#pragma once

#include "engine/base/math.hpp"

namespace cairn {

struct Shape;

// Of the sphere about the body's origin that holds the shape; infinite for planes and meshes.
Real bounding_radius(const Shape& shape);

// The smallest extent: what tolerances are relative to; infinite for planes and meshes.
Real least_extent(const Shape& shape);

}  // namespace cairn
