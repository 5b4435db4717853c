// Joints of a scene as Bullet's constraints.
#pragma once

#include "apps/cli/rivals/bullet_shapes.hpp"

#include <memory>

namespace cairn::cli {

// One side of a joint: the body (Bullet's fixed one for the world) and its pose at the start.
struct BulletSide {
    btRigidBody& body;
    Pose X_WB;
};

std::unique_ptr<btTypedConstraint> bullet_joint(const JointDef& joint, const BulletSide& a, const BulletSide& b);

}  // namespace cairn::cli
