// How fast an island of joints moves, and how RATTLE cuts its step by that. Internal to solver/rattle.
#pragma once

#include "solver/rattle.hpp"

namespace cairn {

struct JointMotion {
    Real tension = 0;  // [rad/s], half the fastest frequency that joint forces give
    Real spin = 0;     // [rad/s], largest ‖w‖
    Real rate = 0;     // [rad/s], Ω of solver/rattle.hpp
    Real speed = 0;    // [m/s], largest of ‖v‖ + size ‖w‖; v beside common_velocity()
};

// The velocity of an island's first body; 0 where the island hangs from what does not move, or moves as it will.
Vec3 common_velocity(const SolverBodies& bodies, const SiIsland& island, const JointRowList& rows);

// `forces` by row [N, N m]; `size`: an arm [m]. `rows` need not be built. `stiffness` is scratch, by body of the island.
JointMotion joint_motion(const SolverBodies& bodies, const JointPool& joints, const SiIsland& island, const JointRowList& rows,
                         const Real* forces, Real size, std::vector<Real>& stiffness);

// Kinetic energy and that in the constant forces [J]; the sum is what a step must keep where nothing is driven and no torque acts.
struct JointEnergy {
    Real kinetic = 0;
    Real total = 0;
    Real weight = 0;  // [N], sum of the forces' sizes
    bool is_kept = true;
};

JointEnergy joint_energy(const SolverBodies& bodies, const SiIsland& island);

struct RattleCut {
    int substeps = 1;
    int stages = 1;  // of a substep
    int total() const { return substeps * stages; }
};

RattleCut choose_cut(const JointMotion& motion, Real dt, Real size, const RattleSettings& settings);

}  // namespace cairn
