// Soft contacts in substeps (TGS soft, Catto 2024: "soft step"): many short substeps of one sweep each rather than few with many.
//
// A substep, h = dt / substeps:
//     kick h, warm start, one sweep in which contacts and joints that are off are damped springs (implicit; contacts 2π f h = ¼ · 2π, ζ =
//     5) drift h one sweep of rigid rows without bias: what the springs have made of velocities goes, positions keep it
// What a spring lets bodies sink falls with h². Of first order; it takes every island and asks for no history but warm impulses. It is
// the method of engines that aim at games, here to be compared with: `auto` does not choose it, since the second-order substep of
// solver/si.hpp is more accurate at its time (docs/solvers.md). Sources: Macklin et al. 2019 (small steps), Catto 2011, 2024.
#pragma once

#include "solver/si.hpp"

namespace cairn {

// Settings of sequential impulses that make it this method: their substeps, tolerance and model, one sweep a solve.
SiSettings tgs_settings(const SiSettings& settings);

// Steps one island by dt, as solve_island_si does.
SiReport solve_island_tgs(SolverBodies& bodies, ContactPool& contacts, JointPool& joints, const SiIsland& island, Real dt,
                          const SiSettings& settings, IslandProbe* probe = nullptr);

}  // namespace cairn
