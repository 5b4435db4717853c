// Bodies: what a caller says of one (BodyDef), and how it is named afterwards (BodyId).
#pragma once

#include "collision/shape.hpp"
#include "engine/base/math.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cairn {

// Handle of a body: an index and a generation, so that a handle kept past its body's removal is an Error and never another body.
struct BodyId {
    std::uint32_t index = UINT32_MAX;
    std::uint32_t generation = 0;
    bool operator==(const BodyId&) const = default;
    // The default handle names no body; joints take it for the world.
    bool is_world() const { return index == UINT32_MAX; }
};

enum class BodyType : std::uint8_t { kStatic, kKinematic, kDynamic };

// Prescribed motion of a kinematic body about its origin: R(t) = exp(axis · amplitude · sin(2π t / period + phase)) R₀.
struct RotateSine {
    Vec3 axis = Vec3::UnitZ();  // unit, world
    Real amplitude = 0;         // [rad]
    Real period = 1;            // [s], > 0
    Real phase = 0;             // [rad]
};

// What add_body takes. The body's origin is its centre of mass.
struct BodyDef {
    std::string name;  // for messages; may be empty
    BodyType type = BodyType::kDynamic;
    Vec3 position = Vec3::Zero();          // [m], world
    Quat rotation = Quat::Identity();      // body to world; normalised when added
    Vec3 linear_velocity = Vec3::Zero();   // [m/s], world
    Vec3 angular_velocity = Vec3::Zero();  // [rad/s], world
    Real mass = 1;                         // [kg], > 0; dynamic bodies only
    // Principal moments [kg m²] about the centre of mass along the body's axes. Default: uniform density over the shapes (overlaps counted
    // twice), whose common centroid must then be the origin; that tensor may have products of inertia.
    std::optional<Vec3> inertia;
    std::vector<Shape> shapes;
    Real friction = 0.5;   // Coulomb coefficient μ, >= 0; a pair has sqrt(μ_a μ_b)
    Real restitution = 0;  // e >= 0 (over 1 a bounce adds energy); a pair has the larger
    // [m], >= 0; a pair has the larger of both. The largest moment against turning about the normal, and against rolling, is this times the
    // normal force of the manifold.
    Real torsional_friction = 0;
    Real rolling_friction = 0;
    Vec3 force = Vec3::Zero();         // [N], constant, world, at the centre of mass
    Vec3 torque = Vec3::Zero();        // [N m], constant, world
    std::optional<RotateSine> motion;  // kinematic bodies only
};

// Where a body is and how it moves. World frame, position and velocity of the centre of mass.
struct BodyState {
    Vec3 position = Vec3::Zero();
    Quat rotation = Quat::Identity();
    Vec3 linear_velocity = Vec3::Zero();
    Vec3 angular_velocity = Vec3::Zero();
};

}  // namespace cairn
