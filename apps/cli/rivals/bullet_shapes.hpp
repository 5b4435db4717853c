// Shapes and numbers as Bullet has them. Single or double precision: as BT_USE_DOUBLE_PRECISION says.
#pragma once

#include "apps/cli/rivals/rival.hpp"
#include "collision/shape.hpp"

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

namespace cairn::cli {

inline btVector3 to_bullet(const Vec3& v) {
    return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}
inline btQuaternion to_bullet(const Quat& q) {
    return {static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()), static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w())};
}
inline btTransform to_bullet(const Pose& X) {
    return btTransform(to_bullet(X.q), to_bullet(X.p));
}
inline Vec3 from_bullet(const btVector3& v) {
    return {v.x(), v.y(), v.z()};
}
inline Quat from_bullet(const btQuaternion& q) {
    return Quat(q.w(), q.x(), q.y(), q.z()).normalized();
}

// Owns Bullet's shapes, which its bodies only point to.
class BulletShapes {
public:
    // The shapes of a body, in the frame that q_BP [body from that frame] turns: a shape, a compound, or an empty one.
    btCollisionShape* add(const std::vector<Shape>& shapes, const Quat& q_BP);

private:
    btCollisionShape* add_one(const Shape& shape);
    btCollisionShape* keep(std::unique_ptr<btCollisionShape> shape);

    std::vector<std::unique_ptr<btStridingMeshInterface>> meshes_;
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
};

}  // namespace cairn::cli
