// The world: owns bodies, joints, the broad phase and the manifold cache, and steps them.
#pragma once

#include "engine/body.hpp"
#include "engine/joint.hpp"
#include "engine/settings.hpp"
#include "engine/step_report.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace cairn {

// One contact point as the solver left it. World frame.
struct ContactPointView {
    Vec3 anchor_a = Vec3::Zero();    // [m], in A's body frame: the point r_A of A's surface
    Vec3 anchor_b = Vec3::Zero();    // [m], in B's body frame
    Vec3 position_a = Vec3::Zero();  // [m], the same points in the world, at the present poses
    Vec3 position_b = Vec3::Zero();
    Real separation = 0;      // [m], nᵀ(r_A − r_B) at the start of the step
    Real normal_impulse = 0;  // λ_N [N s], summed over the substeps
    Vec3 t1 = Vec3::UnitX();  // unit tangents; t1 along the slip where there is one, t2 = n × t1
    Vec3 t2 = Vec3::UnitY();
    Real friction_impulse[2] = {0, 0};  // α₁, α₂ [N s], along t1 and t2
    std::uint32_t feature = 0;
};

// A contact manifold; n points from B to A; the impulse on A at each point is λ_N n + α₁ t₁ + α₂ t₂.
struct ManifoldView {
    BodyId body_a;
    BodyId body_b;
    int shape_a = 0;  // index into the body's shapes
    int shape_b = 0;
    Vec3 n = Vec3::UnitZ();
    Real friction = 0;     // μ of the pair
    Real restitution = 0;  // e of the pair
    int count = 0;
    ContactPointView points[4];
};

class World {
public:
    explicit World(const WorldSettings& settings = {});  // throws Error on a bad setting
    ~World();
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;

    // Throws Error, changing nothing, when a value is not finite or out of range.
    BodyId add_body(const BodyDef& def);
    JointId add_joint(const JointDef& def);
    void remove_body(BodyId body);  // and its joints
    void remove_joint(JointId joint);

    // Advances by dt [s]. Never throws; a dt that is not finite, or whose substeps are shorter than kLeastSubstep, changes nothing and
    // reports !ok.
    StepReport step(Real dt) noexcept;

    Real time() const;  // [s] since construction
    const WorldSettings& settings() const;
    void set_gravity(const Vec3& gravity);

    // Stale handles throw Error.
    BodyState state(BodyId body) const;
    void set_state(BodyId body, const BodyState& state);
    // Constant until set to another; world frame, at the centre of mass.
    void set_force(BodyId body, const Vec3& force, const Vec3& torque);
    void apply_impulse(BodyId body, const Vec3& impulse, const Vec3& point);  // [N s] at a world point
    BodyType type(BodyId body) const;
    Real mass(BodyId body) const;     // [kg]; 0 for static and kinematic bodies
    Mat3 inertia(BodyId body) const;  // [kg m²], body frame, about the centre of mass
    const std::string& name(BodyId body) const;
    bool is_sleeping(BodyId body) const;
    bool is_enabled(BodyId body) const;  // false: it went non-finite and was taken out
    void wake(BodyId body);

    std::vector<BodyId> bodies() const;  // in order of creation
    std::size_t body_count() const;
    std::size_t joint_count() const;
    // Separation of the anchors [m] and misalignment [rad] of a joint.
    struct JointError {
        Real position = 0;
        Real angle = 0;
    };
    JointError joint_error(JointId joint) const;

    // The manifold cache, in a deterministic order. Valid until the next call that changes the world.
    std::vector<ManifoldView> manifolds() const;

    Real kinetic_energy() const;    // [J], dynamic bodies
    Real potential_energy() const;  // [J], −Σ m g·x
    // Hash of every bit that the next step depends on (poses, velocities, forces, flags, fat boxes, the whole manifold cache, joints,
    // gravity, time) and of the impulses that the last one reported; not of names and settings. Equal hashes after equal calls.
    std::uint64_t hash() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace cairn
