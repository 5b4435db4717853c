// What is measured of a solve where somebody asks for it: residuals of rows and the work of impulses. Plain data; solver/island_probe.hpp
// fills it.
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>

namespace cairn {

enum class RowKind : std::uint8_t { kNone, kNormal, kFriction, kJoint };

// Natural-map residuals of rows [m/s] (solver/residual.hpp).
struct ResidualMeasure {
    Real max = 0;
    Real sum_of_squares = 0;
    std::uint64_t rows = 0;
    // Where the largest is: the contact block, or the joint in the pool of its kind. Of equal ones the first.
    RowKind kind = RowKind::kNone;
    int joint_kind = 0;
    int index = -1;

    void add(Real residual, RowKind row_kind, int row_joint_kind, int row_index) {
        ++rows;
        sum_of_squares += residual * residual;
        if (!(residual > max)) return;
        max = residual;
        kind = row_kind;
        joint_kind = row_joint_kind;
        index = row_index;
    }
};

// Kinetic energy that the impulses of a step gave to an island's dynamic bodies [J], by what they were for (solver/island_probe.hpp).
struct ImpulseWork {
    Real impacts = 0;
    Real friction = 0;
    Real joints = 0;
    Real driven = 0;
    Real stabilisation = 0;
};

}  // namespace cairn
