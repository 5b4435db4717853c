// What a world holds, and the stages of its step (each in a file of its own). Internal: consumers see engine/world.hpp.
#pragma once

#include "collision/broad_phase.hpp"
#include "collision/narrow_phase.hpp"
#include "engine/active.hpp"
#include "engine/base/team.hpp"
#include "engine/choose_solver.hpp"
#include "engine/contact_store.hpp"
#include "engine/island.hpp"
#include "engine/tasks.hpp"
#include "engine/world.hpp"
#include "solver/block_order.hpp"
#include "solver/island_probe.hpp"
#include "solver/rattle.hpp"

#include <limits>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

namespace cairn {

// The part of a body that steps read. Poses and velocities in World. What every step reads of a body that moves alone comes first and fills
// whole cache lines, so that the rest stays out of the cache.
struct alignas(64) Body {
    static constexpr Real kFar = std::numeric_limits<Real>::infinity();
    Pose X_WB;
    BodyType type = BodyType::kStatic;
    bool alive = true;
    bool enabled = true;
    bool asleep = false;
    bool moved : 1 = false;  // a caller put it somewhere: its shapes have to be told to the broad phase even if it does not move by itself
    bool was_moving : 1 = false;  // kinematic: in the last step
    bool has_load = false;        // force or torque is not zero
    bool is_spherical = true;     // its moments are equal
    bool stands = false;          // the last step left all of its island as it was, and nobody has touched it since: see standing.cpp
    Vec3 v = Vec3::Zero();
    Vec3 w = Vec3::Zero();
    Real inv_mass = 0;                                       // dynamic bodies only; else 0
    Real radius = 0;                                         // [m], of the sphere about the origin that holds the shapes
    Mat3 R = Mat3::Identity();                               // of X_WB.q
    Real turned = 0;                                         // summed turn_ways since it was added
    Aabb room{Vec3::Constant(kFar), Vec3::Constant(-kFar)};  // see update_pairs.cpp
    Mat3 inv_inertia_B = Mat3::Zero();
    RotorInertia rotor;
    Vec3 force = Vec3::Zero();
    Vec3 torque = Vec3::Zero();
    std::uint32_t shape_begin = 0;  // its shapes in WorldData::shapes
    std::uint32_t shape_count = 0;
    std::uint32_t sleep_group = 0;  // bodies that fell asleep together wake together
    std::uint32_t sleep_next = 0;   // the next one in the ring of its group

    bool is_dynamic() const { return type == BodyType::kDynamic && enabled; }
    bool is_awake() const { return type == BodyType::kDynamic && enabled && !asleep; }
    Transform transform() const { return {R, X_WB.p}; }
};

// How far a point moves at most by a turn from one unit quaternion to another, per distance from the axis: 2 sin(θ/2) ≤ 2 ‖q − p‖.
inline Real turn_way(const Quat& p, const Quat& q) {
    return 2 * (q.coeffs() - p.coeffs()).norm();
}

// Whether the body moves in this step or may: awake, or driven.
inline bool is_moving(const Body& b) {
    return b.is_awake() || (b.type == BodyType::kKinematic && b.enabled && !(b.v.isZero(0) && b.w.isZero(0)));
}

// The same without what stands: its pose is that of the last step's start.
inline bool may_move(const Body& b) {
    return is_moving(b) && !b.stands;
}

// For how long a body has stayed where it is, to within some distance.
struct RestWindow {
    Pose X_WB;      // where it was when the window began
    Real time = 0;  // [s], since then
};

// Two windows, see sleep.cpp.
struct RestState {
    RestWindow windows[2];
};

// The part that steps rarely read.
struct BodyInfo {
    std::string name;
    std::uint32_t generation = 0;
    Real mass = 0;
    Mat3 inertia_B = Mat3::Zero();
    Real friction = 0;
    Real restitution = 0;
    Real torsional_friction = 0;
    Real rolling_friction = 0;
    std::optional<RotateSine> motion;
    Quat rotation0 = Quat::Identity();  // of a kinematic body with a motion: its rotation at sin(…) = 0
    Real motion_time0 = 0;              // [s], world time at which its motion began
};

// A shape in the world.
struct ShapeRecord {
    Shape shape;
    std::uint32_t body = 0;
    std::uint32_t index = 0;  // among its body's shapes
    ProxyId proxy = kNoProxy;
    Transform X_BS;
    bool at_body = false;  // X_BS is the identity
    Real size = 0;         // [m], smallest extent (planes and meshes: unbounded)
    Real spin_radius = 0;  // [m], how far the farthest point moves when the body turns by a radian

    Transform pose(const Transform& X_WB) const { return at_body ? X_WB : X_WB * X_BS; }
};

// What the pass over all pairs reads of a shape; of those in a contact alone, once a step.
struct ShapeMotion {
    static constexpr std::uint32_t kStatic = UINT32_MAX;
    Aabb tight;              // world; unbounded for planes
    Vec3 v = Vec3::Zero();   // [m/s], of its body
    Real ball = 0;           // [m], radius of a ball about the middle of `tight` that holds the shape; unbounded where there is none
    Real reach = 0;          // [m], reach_without_way (engine/reach.hpp)
    Vec3 x = Vec3::Zero();   // [m], of its body
    Real turned = 0;         // [m], how far turns of its body have moved its points, at most, in all
    std::uint32_t step = 0;  // WorldData::motion_step of which this is; kStatic: holds until the body is put elsewhere
    bool moves = false;      // its body is awake or driven
};

struct Joint {
    JointType type = JointType::kBall;
    std::uint32_t body_a = UINT32_MAX;  // UINT32_MAX: the world
    std::uint32_t body_b = UINT32_MAX;
    JointGeometry geometry;
    VecN<6> warm_first = VecN<6>::Zero();  // what a substep's two solves start with
    VecN<6> warm_second = VecN<6>::Zero();
    VecN<6> total = VecN<6>::Zero();  // of the last step
    std::uint32_t generation = 0;
    bool collide_connected = false;
    bool alive = true;
};

// How the error of an island (at its lowest body) or of a free body is kept below WorldSettings::tolerance (error_control.hpp).
struct ErrorControl {
    int level = 0;                // of refinement
    int steps_left = 0;           // until the next estimate
    int interval = 1;             // between estimates, in steps
    std::uint64_t signature = 0;  // of what was measured
    Real error = 0;               // [m], of a step at `level`, as last measured
    Real gained = 0;              // factor by which the error grows from `level` to the one below, as last measured; 0: not known
    Real jump = 0;                // [m/s], see error_control.cpp
    Vec3 gain = Vec3::Zero();     // [m/s], of this body's velocity in the last step
    bool disturbed = true;        // a caller changed the body
};

// Where a block of the solver came from: its contact, and its manifold, which stays where it is until the step ends.
struct BlockSource {
    std::uint32_t contact = 0;
    CachedManifold* manifold = nullptr;
};

// Where a joint block came from.
struct JointSource {
    std::uint32_t joint = 0;
};

// Where the next block goes in a ContactPool.
struct ContactPlace {
    std::size_t block = 0, point = 0, friction = 0;
    bool has_bounce = false;  // one so far has restitution
};

// What one worker solves islands with, one after the other, and what it has counted. Kept for its memory.
struct IslandWorkspace {
    Team* team = nullptr;  // that solves the island, if it is a large one; else one worker does
    SolverBodies solver_bodies;
    ContactPool contact_pool;
    WideContacts wide_contacts;
    BlockOrder block_order;
    bool island_stands = false;   // the step has changed nothing of it
    bool is_island_wide = false;  // the island that is being solved: its impulses are in wide_contacts
    JointPool joint_pool;
    RattleWorkspace rattle;
    MixedWorkspace mixed;
    std::vector<BlockSource> block_sources, unsorted_sources;
    std::vector<ContactPlace> places;  // by piece of contacts
    std::vector<std::uint32_t> joint_sources[5];
    std::vector<int> solver_index;  // body → index in solver_bodies, this island; else −1
    std::vector<std::uint32_t> kinematic_used;
    std::vector<std::pair<int, int>> island_pairs;
    std::vector<int> depths;  // of an island's bodies
    SiReport solved;
    IslandProbe probe;  // with WorldSettings::diagnostics
    StepReport report;
    std::vector<std::uint32_t> broken;
    SolverBodies coarse;  // result of a coarser solve of the same step
};

// What one worker updates contacts with, and what it has counted. Kept for its memory; on cache lines of its own.
struct alignas(64) NarrowWorkspace {
    std::vector<Manifold> fresh, foreseen;
    NarrowStats stats;
    std::uint32_t manifolds = 0, points = 0, reused = 0, updated = 0;
    Real max_penetration = 0;
    bool has_stopped = false;                                 // a contact of which nothing moves is in the list
    std::vector<std::uint32_t> released;                      // contacts that were held
    std::uint32_t queries_of[kShapeTypes][kShapeTypes] = {};  // with WorldSettings::profile
    std::uint32_t fcl_calls_of[kShapeTypes][kShapeTypes] = {};
    void clear();
};

// What a step's diagnostics are measured against, and what they are summed from.
struct DiagnosticsStart {
    std::vector<Pose> poses;        // size of bodies
    Real kinetic = 0;               // [J]
    Real awake = 0;                 // [J], the same before bodies were put to sleep
    std::vector<ImpulseWork> work;  // by island
};

struct WorldData {
    WorldSettings settings;
    Real time = 0;
    std::vector<Body> bodies;
    std::vector<BodyInfo> info;
    bool has_spin_friction = false;     // a body has been added that has torsional or rolling friction
    std::vector<RestState> rest;        // size of bodies; with WorldSettings::sleep
    std::vector<ErrorControl> control;  // size of bodies; with WorldSettings::tolerance
    std::vector<ShapeRecord> shapes;
    std::vector<ShapeMotion> motions;  // of the shapes
    std::uint32_t motion_step = 0;
    std::vector<Joint> joints;
    std::vector<std::uint32_t> free_bodies;
    std::vector<std::uint32_t> free_joints;
    std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> free_shape_blocks;  // by their length
    BroadPhase broad_phase;
    ActiveSets active;
    ContactStore contacts;
    std::unordered_map<std::uint64_t, int> jointed_pairs;  // body pairs whose joint keeps them from colliding
    std::uint32_t next_sleep_group = 1;
    Real last_dt = 0;
    std::uint64_t step_count = 0;
    std::unordered_map<std::uint32_t, DirectState> direct_states;  // by the lowest body of the island
    std::mutex direct_mutex;                                       // of the map, not of what is in it
    std::shared_ptr<TaskSystem> tasks;                             // null: all on the calling thread
    double last_work = 0;                                          // [s], estimated, of the last step

    // Scratch of a step: kept for its memory.
    Team* team = nullptr;  // that does the step; null: the calling thread alone
    std::vector<ProxyPair> begun, ended;
    std::vector<std::uint8_t> leaving;    // of each awake body: whether it leaves its boxes
    std::vector<NarrowWorkspace> narrow;  // one per worker
    std::uint32_t contacts_updated = 0;
    IslandBuilder islands;
    std::vector<IslandWorkspace> workspaces;  // one per worker
    std::vector<std::uint32_t> broken;        // bodies that have gone non-finite in this step
    PhaseClock clock;
    StepDiagnostics diagnostics;
    DiagnosticsStart diagnostics_start;
};

// External acceleration of a dynamic body [m/s²].
inline Vec3 external_acceleration(const WorldData& world, const Body& body) {
    return body.has_load ? Vec3(world.settings.gravity + body.inv_mass * body.force) : world.settings.gravity;
}

// Stages of the step, in order; each fills its part of the report.
void drive_kinematic_bodies(WorldData& world, Real dt);
void update_pairs(WorldData& world, Real dt, StepReport& report);
// Brings the ShapeMotion of a body's shapes up to date (contact_update.cpp).
void note_motion(WorldData& world, const Body& body, Real dt);
// Begins and ends contacts by what moved since the last call.
void flush_broad_phase(WorldData& world);
void update_contacts(WorldData& world, Real dt, StepReport& report);
void wake_touched(WorldData& world);
void build_islands(WorldData& world, StepReport& report);
void solve_islands(WorldData& world, Real dt, StepReport& report);
void move_free_bodies(WorldData& world, Real dt, StepReport& report);
void move_kinematic_bodies(WorldData& world, Real dt, StepReport& report);
void put_to_sleep(WorldData& world, Real dt, StepReport& report);

// Diagnostics of a step (step_diagnostics.cpp): before its first stage, after the solve of an island, before bodies are put to sleep, after
// the last stage.
void begin_diagnostics(WorldData& world);
void note_island(WorldData& world, const IslandWorkspace& work, int index, const SiIsland& island, IslandReport& report);
void note_awake(WorldData& world);
void finish_diagnostics(WorldData& world, StepReport& report);

Real kinetic_energy(const WorldData& world);  // [J], of the dynamic bodies
World::JointError measure_joint(const WorldData& world, const Joint& joint);

// Islands of which a step changes nothing (standing.cpp). Whether this one is as a step has left it that changed nothing.
bool is_standing(const WorldData& world, int index);
void report_standing(WorldData& world, int index, StepReport& report);
// Notes that a step has changed nothing of the island.
void note_standing(WorldData& world, int index);

// Adds an island's own copy of a kinematic body; returns its index in solver_bodies.
int add_kinematic(WorldData& world, IslandWorkspace& work, std::uint32_t body, SiIsland& island);

// Rows of the manifolds and joints of one island; bodies must be in solver_bodies and solver_index. `range` gets the blocks.
void build_contact_blocks(WorldData& world, IslandWorkspace& work, const std::vector<std::uint32_t>& order, int begin, int end,
                          SiIsland& island);
void store_contact_impulses(IslandWorkspace& work, const SiIsland& island);
void build_joint_blocks(WorldData& world, IslandWorkspace& work, int index, SiIsland& island);
void store_joint_impulses(WorldData& world, IslandWorkspace& work, const SiIsland& island);

// Writes a body's new state. False if it is not finite: then the body stays where it was, and disable_broken has to be told.
bool accept_state(Body& body, const Pose& pose, const Vec3& v, const Vec3& w);
// Takes the bodies in WorldData::broken, in any order, out of the world and reports them.
void disable_broken(WorldData& world, StepReport& report);
void disable_body(WorldData& world, std::uint32_t body);
void wake_group(WorldData& world, std::uint32_t body);
// Wakes what has a contact with the body, touching or near.
void wake_neighbours(WorldData& world, std::uint32_t body);

// Relation of two bodies that may touch: at least one dynamic, not kept apart by a joint.
bool may_collide(const WorldData& world, std::uint32_t body_a, std::uint32_t body_b);

}  // namespace cairn
