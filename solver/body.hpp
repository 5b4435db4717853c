// Bodies as the solvers see them: one array of velocities, one of everything else. Index kImmovable is the world; static and kinematic
// bodies have zero inverse mass and inertia, and solvers never write their velocity.
#pragma once

#include "solver/rotor.hpp"

#include <vector>

namespace cairn {

constexpr int kImmovable = 0;

// All in World. On a cache line of its own, since threads that solve parts of an island write those of neighbours.
struct alignas(64) BodyVelocity {
    Vec3 v = Vec3::Zero();  // [m/s], of the centre of mass
    Vec3 w = Vec3::Zero();  // [rad/s]
};

struct BodyMotion {
    Vec3 x = Vec3::Zero();              // [m], centre of mass
    Quat q = Quat::Identity();          // body to world
    Mat3 R = Mat3::Identity();          // matrix of q
    Real inv_mass = 0;                  // [1/kg]
    Mat3 inv_inertia_B = Mat3::Zero();  // [1/(kg m²)], body frame
    Mat3 inv_inertia_W = Mat3::Zero();  // the same in World, at R
    Vec3 acceleration = Vec3::Zero();   // [m/s²], of gravity and the constant force
    Vec3 torque = Vec3::Zero();         // [N m], constant, world
    Real radius = 0;                    // [m], of a sphere about x that holds the body
    RotorInertia rotor;
    Real turned = 0;  // [rad], sum of ‖w‖h since the step began: bounds how far R is from where rows were built
    bool moves = false;
};

struct SolverBodies {
    std::vector<BodyVelocity> velocity;  // size n
    std::vector<BodyMotion> motion;      // size n
    std::vector<BodyVelocity> push;      // size n, scratch: what the position solve adds to the velocities for the drift alone
    std::vector<Real> gain;              // size n, scratch: solver/energy_gain.hpp
    void clear() {
        velocity.clear();
        motion.clear();
    }
    int size() const { return static_cast<int>(motion.size()); }
};

// v += h a, w += h I⁻¹ τ for the dynamic bodies of [begin, end).
void kick(SolverBodies& bodies, int begin, int end, Real h);

// Moves bodies of [begin, end) by their velocities over h: x += h v; rotation by the free-rigid-body flow (Verlet's drift, so that
// kick(h/2), drift(h), kick(h/2) is of 2nd order and exact under constant acceleration). Returns the number of rotor calls that were not
// spherical.
int drift(SolverBodies& bodies, int begin, int end, Real h);

// A push moves bodies of [begin, end) in a drift and leaves no velocity behind: begin, change the velocities, measure, drift, end.
void begin_push(SolverBodies& bodies, int begin, int end);    // notes the velocities
void measure_push(SolverBodies& bodies, int begin, int end);  // what has been added to them since
void end_push(SolverBodies& bodies, int begin, int end);      // takes that away again

// Moves kinematic bodies of [begin, end): constant velocity, rotation about a fixed axis.
void drift_kinematic(SolverBodies& bodies, int begin, int end, Real h);

}  // namespace cairn
