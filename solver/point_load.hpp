// From the states of contact points to the pool, and back. The wide kernels do the same for four points at a time (solver/wide_load.hpp).
#pragma once

#include "solver/contact_rows.hpp"
#include "solver/si_model.hpp"

namespace cairn {

struct PointLoad {
    Real dt = 0;  // [s], of the step
    FrictionModel friction = FrictionModel::kPyramid;
    Real warm_scale = 1;  // of the warm impulses, for substeps of another length
};

// Geometry, first tangents and warm impulses of the blocks of a range, from their states. t₁ is chosen along the slip; where that is slower
// than what the external acceleration makes in the step, along the slip that it will make; where that is slow too, as it was.
void load_points(ContactPool& pool, BlockRange range, const SolverBodies& bodies, const PointLoad& load);

// The other way: warm and total impulses. Signs of zeros are dropped.
void store_points(const ContactPool& pool, BlockRange range);

}  // namespace cairn
