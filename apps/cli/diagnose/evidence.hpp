// What a run shows, as far as causes ask for it: bodies, what bears them, pairs, joints, and how the solver fared.
#pragma once

#include "apps/cli/runner.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace cairn::cli {

struct BodyEvidence {
    Real radius = 0;                 // [m], of a sphere about the centre of mass that holds the shapes
    Real least = 0;                  // [m], least extent of a shape
    bool should_rest = false;        // starts at rest and held up, and nothing that moves ever touches what it touches
    int group = -1;                  // of the dynamic bodies that touch or are joined, at any time; −1: not dynamic
    Real moved = 0;                  // [m], farthest from where it had settled; its turn counts with the radius
    Real late_speed = 0;             // [m/s], over the last quarter of the run
    Real way_per_step = 0;           // [m], largest
    Real turn_per_step = 0;          // [rad], largest
    std::vector<std::size_t> on_it;  // bodies that rest on it at the start
};

// What bears a body and all that rests on it, at the start.
struct Support {
    bool is_plane = false;     // contacts with others, whose normals point one way
    Vec3 n = Vec3::Zero();     // mean normal, up
    Real friction = 0;         // largest μ of them
    std::vector<Vec3> points;  // [m]
    std::vector<std::size_t> bearers;
    Vec3 centre = Vec3::Zero();      // [m], of mass, of all that it bears
    Real mass = 0;                   // [kg]
    std::vector<std::size_t> borne;  // the body and what rests on it
};

struct PairEvidence {
    std::size_t a = 0, b = 0;
    Vec3 n = Vec3::Zero();  // from b to a, when first seen
    Real start_depth = 0;   // [m], at the start of the first step
    Real late_depth = 0;    // [m], mean over the last quarter of the deepest point
};

struct JointEvidence {
    Real arm = 0;         // [m], longest, of a body that moves; length of a rod
    Real error = 0;       // [m], largest separation after the first step
    Real angle = 0;       // [rad]
    Real late_error = 0;  // [m], at the end
};

// How the solver fared in a group, from half of the run on (where it fails, from the step before on).
struct GroupEvidence {
    Real residual = 0;             // [m/s], largest natural residual
    std::string worst_a, worst_b;  // bodies of that row
    long si_islands = 0;           // solved by sequential impulses
    long capped_islands = 0;       // of them, that used all the sweeps they may
    long islands = 0;
    int solver_steps[kSolverChoices] = {};
};

struct Evidence {
    bool ok = true;
    std::string refused;  // why a forced solver could not go on; then the rest holds up to there
    std::size_t disabled_body = SIZE_MAX;
    Real settle = 0;  // [s]
    Vec3 up = Vec3::Zero();
    std::vector<BodyEvidence> bodies;  // by body of the scene
    std::vector<Support> supports;     // likewise; empty where nothing bears it
    std::vector<PairEvidence> pairs;
    std::vector<JointEvidence> joints;  // by joint of the scene
    std::vector<BodyState> end;         // by body of the scene
    std::vector<GroupEvidence> groups;
};

// Runs the scene to its end.
Evidence observe(const Scene& scene, const RunOptions& options, const StepCallback& on_step = {});

// [m]: radius about the body's origin and least extent of its shapes; of planes and meshes infinite.
Real body_radius(const BodyDef& body);
Real least_extent(const BodyDef& body);

}  // namespace cairn::cli
