// What a contact point carries from step to step: the manifold cache owns it; the solver takes it over at a step's start and leaves its
// impulses there at the end (solver/point_load.hpp).
#pragma once

#include "engine/base/math.hpp"

#include <cstddef>
#include <cstdint>

namespace cairn {

// Rows of four doubles, for wide kernels to read four points at a time (solver/wide_data.hpp names them).
struct PointState {
    Vec3 core_a_A = Vec3::Zero();  // [m], core points in the bodies' frames
    Real radius_a = 0;
    Vec3 core_b_B = Vec3::Zero();
    Real radius_b = 0;
    Vec3 t1 = Vec3::Zero();                   // unit, world, at the start of the last step; zero: none yet
    Real separation = 0;                      // [m], at the start of the last step
    Vec3 warm_friction = Vec3::Zero();        // [N s], world: what a substep starts with (WarmImpulse), along any tangents
    Real warm_velocity = 0;                   // [N s]
    Vec3 warm_friction_first = Vec3::Zero();  // [N s], world, of the first solve
    Real warm_position = 0;                   // [N s]
    Real normal_impulse = 0;                  // [N s], summed over the last step's substeps
    Real friction_impulse[2] = {0, 0};        // [N s], along t1 and n × t1, likewise
    std::uint32_t feature = 0;
};
static_assert(sizeof(PointState) == 24 * sizeof(Real) && offsetof(PointState, core_b_B) == 4 * sizeof(Real) &&
              offsetof(PointState, t1) == 8 * sizeof(Real) && offsetof(PointState, warm_friction) == 12 * sizeof(Real) &&
              offsetof(PointState, warm_friction_first) == 16 * sizeof(Real) && offsetof(PointState, normal_impulse) == 20 * sizeof(Real));

}  // namespace cairn
