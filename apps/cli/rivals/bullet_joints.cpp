#include "apps/cli/rivals/bullet_joints.hpp"

#include "apps/cli/rivals/parts.hpp"

namespace cairn::cli {

namespace {

// A rigid rod between two anchors, which Bullet does not have: C = ‖x_A − x_B‖ − l = 0, one row along the unit vector between them,
// worked off with the error reduction that Bullet's own constraints use.
class Rod : public btTypedConstraint {
public:
    Rod(btRigidBody& a, btRigidBody& b, const btVector3& anchor_a, const btVector3& anchor_b, btScalar length)
        : btTypedConstraint(MAX_CONSTRAINT_TYPE, a, b), anchor_a_(anchor_a), anchor_b_(anchor_b), length_(length) {}

    void getInfo1(btConstraintInfo1* info) override {
        info->m_numConstraintRows = 1;
        info->nub = 5;
    }
    void getInfo2(btConstraintInfo2* info) override {
        const btVector3 r_a = m_rbA.getWorldTransform().getBasis() * anchor_a_;
        const btVector3 r_b = m_rbB.getWorldTransform().getBasis() * anchor_b_;
        const btVector3 between = m_rbA.getWorldTransform().getOrigin() + r_a - m_rbB.getWorldTransform().getOrigin() - r_b;
        const btScalar now = between.length();
        const btVector3 n = now > SIMD_EPSILON ? between / now : btVector3(0, 0, 1);
        const btVector3 turn_a = r_a.cross(n), turn_b = r_b.cross(n);
        for (int k = 0; k < 3; ++k) {
            info->m_J1linearAxis[k] = n[k];
            info->m_J1angularAxis[k] = turn_a[k];
            info->m_J2linearAxis[k] = -n[k];
            info->m_J2angularAxis[k] = -turn_b[k];
        }
        info->m_constraintError[0] = info->fps * info->erp * (length_ - now);
    }
    void setParam(int, btScalar, int) override {}
    btScalar getParam(int, int) const override { return 0; }

private:
    btVector3 anchor_a_, anchor_b_;
    btScalar length_;
};

btVector3 local_point(const BulletSide& side, const Vec3& p_W) {
    return to_bullet(Vec3(side.X_WB.q.conjugate() * (p_W - side.X_WB.p)));
}

// The frame with this origin and rotation in the world, seen from the side's body.
btTransform local_frame(const BulletSide& side, const Vec3& p_W, const Quat& q_W) {
    return btTransform(to_bullet(Quat(side.X_WB.q.conjugate() * q_W)), local_point(side, p_W));
}

}  // namespace

std::unique_ptr<btTypedConstraint> bullet_joint(const JointDef& j, const BulletSide& a, const BulletSide& b) {
    const Vec3 axis = j.axis.normalized(), across = any_perpendicular(axis);
    switch (j.type) {
        case JointType::kBall:
            return std::make_unique<btPoint2PointConstraint>(a.body, b.body, local_point(a, j.anchor_a), local_point(b, j.anchor_a));
        case JointType::kHinge: {  // turns about its frames' z
            const Quat q = triad(across, axis.cross(across));
            return std::make_unique<btHingeConstraint>(a.body, b.body, local_frame(a, j.anchor_a, q), local_frame(b, j.anchor_a, q));
        }
        case JointType::kSlider: {  // moves along its frames' x; comes with damping, which a slider of ours has not
            const Quat q = triad(axis, across);
            auto slider =
                std::make_unique<btSliderConstraint>(a.body, b.body, local_frame(a, j.anchor_a, q), local_frame(b, j.anchor_a, q), true);
            slider->setDampingDirLin(0);
            return slider;
        }
        case JointType::kFixed: {
            const Quat q = Quat::Identity();
            return std::make_unique<btFixedConstraint>(a.body, b.body, local_frame(a, j.anchor_a, q), local_frame(b, j.anchor_a, q));
        }
        case JointType::kDistance:
            return std::make_unique<Rod>(a.body, b.body, local_point(a, j.anchor_a), local_point(b, j.anchor_b),
                                         static_cast<btScalar>((j.anchor_a - j.anchor_b).norm()));
    }
    throw Unsupported("joint");
}

}  // namespace cairn::cli
