// Joints: what a caller says of one, in world coordinates at the time it is added.
#pragma once

#include "engine/body.hpp"

#include <cstdint>
#include <string>

namespace cairn {

enum class JointType : std::uint8_t { kBall, kHinge, kSlider, kFixed, kDistance };

struct JointId {
    std::uint32_t index = UINT32_MAX;
    std::uint32_t generation = 0;
    bool operator==(const JointId&) const = default;
};

// [m]: how far an anchor may be from the centre of mass of a dynamic body that it belongs to, and how long a rod may be. Effective masses
// hold the square of the arm beside 1/m; a hundred times farther, solving for impulses loses all digits for some bodies.
constexpr Real kMostJointArm = 1e6;

// What add_joint takes. Two bodies, either of which may be the world (BodyId{}), not both, not the same.
struct JointDef {
    JointType type = JointType::kBall;
    BodyId body_a;
    BodyId body_b;
    // [m], world, within kMostJointArm of the bodies. All but the distance joint use this one for both bodies.
    Vec3 anchor_a = Vec3::Zero();
    Vec3 anchor_b = Vec3::Zero();  // [m], world. Distance joint only: a rigid rod of the initial length ‖anchor_a − anchor_b‖ > 0
    Vec3 axis = Vec3::UnitZ();     // world; hinge and slider; normalised when added
    bool collide_connected = false;
};

const char* to_string(JointType type);

}  // namespace cairn
