// Bullet (btDiscreteDynamicsWorld, sequential impulses). Its own defaults, but for what the scene says: no damping, no sleep unless asked
// for, friction of a pair √(μ_a μ_b), restitution the larger one, at any speed.
#include "apps/cli/rivals/bullet_joints.hpp"
#include "apps/cli/rivals/bullet_shapes.hpp"
#include "apps/cli/rivals/module.hpp"
#include "apps/cli/rivals/parts.hpp"
#include "collision/mass_properties.hpp"

#include <fmt/format.h>

#include <memory>

namespace cairn::cli {

namespace {

btScalar pair_friction(const btCollisionObject* a, const btCollisionObject* b) {
    return btSqrt(a->getFriction() * b->getFriction());
}
btScalar pair_restitution(const btCollisionObject* a, const btCollisionObject* b) {
    return btMax(a->getRestitution(), b->getRestitution());
}

// Where a kinematic body is to be at the end of the step: Bullet asks, and takes its velocity from the difference.
struct DrivenState : btMotionState {
    btTransform target;
    void getWorldTransform(btTransform& out) const override { out = target; }
    void setWorldTransform(const btTransform&) override {}
};

class Bullet : public Rival {
public:
    Bullet(const Scene& scene, const RivalOptions& options)
        : scene_(scene),
          substeps_(options.substeps.value_or(1)),
          dispatcher_(&configuration_),
          world_(&dispatcher_, &broad_phase_, &solver_, &configuration_) {
        refuse_what_no_adapter_has(scene);
        if (!options.variant.empty() && options.variant != "2dir") throw_invalid("variant", options.variant, "2dir");
        gCalculateCombinedFrictionCallback = pair_friction;
        gCalculateCombinedRestitutionCallback = pair_restitution;
        world_.setGravity(to_bullet(scene.gravity));
        btContactSolverInfo& info = world_.getSolverInfo();
        if (options.iterations) info.m_numIterations = *options.iterations;
        info.m_restitutionVelocityThreshold = 0;
        if (options.variant == "2dir") info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
        for (const BodyDef& body : scene.bodies) add_body(body, options.sleep);
        for (const SceneJoint& joint : scene.joints) add_joint(joint);
    }
    ~Bullet() override {
        for (const auto& joint : joints_) world_.removeConstraint(joint.get());
        for (const auto& body : bodies_) world_.removeRigidBody(body.get());
    }

    std::string version() const override { return fmt::format("{}.{}", btGetVersion() / 100, btGetVersion() % 100); }
    int precision() const override { return 8 * static_cast<int>(sizeof(btScalar)); }
    std::string settings() const override {
        const btContactSolverInfo& info = const_cast<btDiscreteDynamicsWorld&>(world_).getSolverInfo();
        return fmt::format(
            "{} substeps, {} iterations, erp {}, erp2 {}, split impulse {}, warm start {}, {} friction directions, hull margin <= 0.04 m, "
            "restitution at any speed, no ccd",
            substeps_, info.m_numIterations, info.m_erp, info.m_erp2, info.m_splitImpulse ? "on" : "off", info.m_warmstartingFactor,
            (info.m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS) != 0 ? 2 : 1);
    }

    void step(Real dt) override {
        const Real h = dt / substeps_;
        for (int k = 1; k <= substeps_; ++k) {
            const Real until = k == substeps_ ? time_ + dt : time_ + k * h;
            for (std::size_t i = 0; i < bodies_.size(); ++i) {
                const BodyDef& body = scene_.bodies[i];
                if (driven_[i]) driven_[i]->target = to_bullet(driven_pose(body, until));
                if (body.type != BodyType::kDynamic) continue;
                if (!body.force.isZero(0)) bodies_[i]->applyCentralForce(to_bullet(body.force));
                if (!body.torque.isZero(0)) bodies_[i]->applyTorque(to_bullet(body.torque));
            }
            world_.stepSimulation(static_cast<btScalar>(h), 0);
        }
        time_ += dt;
    }

    void states(std::vector<BodyState>& out) const override {
        out.clear();
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            const btTransform& X = bodies_[i]->getWorldTransform();
            const Quat q_WB = from_bullet(X.getRotation()) * frames_[i].conjugate();
            out.push_back({from_bullet(X.getOrigin()), q_WB, from_bullet(bodies_[i]->getLinearVelocity()),
                           from_bullet(bodies_[i]->getAngularVelocity())});
        }
    }

    int contacts() const override {
        int points = 0;
        for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
            points += const_cast<btCollisionDispatcher&>(dispatcher_).getManifoldByIndexInternal(i)->getNumContacts();
        }
        return points;
    }

private:
    void add_body(const BodyDef& body, bool sleep) {
        const bool dynamic = body.type == BodyType::kDynamic;
        // Bullet's frame of a body must be that of its principal axes.
        PrincipalInertia inertia;
        if (body.inertia) inertia.moments = *body.inertia;
        if (dynamic && !body.inertia) {
            const Mat3 I = inertia_of(body);
            inertia.moments = I.diagonal();
            const Real off = std::abs(I(0, 1)) + std::abs(I(0, 2)) + std::abs(I(1, 2));
            if (off > 1e-12 * I.trace()) inertia = principal_inertia(I);
        }
        frames_.push_back(inertia.R_BP);
        btCollisionShape* shape = shapes_.add(body.shapes, inertia.R_BP);
        const Pose start = body.type == BodyType::kKinematic ? driven_pose(body, 0) : Pose{body.rotation.normalized(), body.position};
        start_.push_back({start.q * inertia.R_BP, start.p});
        driven_.push_back(nullptr);
        if (body.type == BodyType::kKinematic) {
            driven_.back() = std::make_unique<DrivenState>();
            driven_.back()->target = to_bullet(start_.back());
        }
        btRigidBody::btRigidBodyConstructionInfo info(dynamic ? static_cast<btScalar>(body.mass) : 0, driven_.back().get(), shape,
                                                      dynamic ? to_bullet(inertia.moments) : btVector3(0, 0, 0));
        if (!driven_.back()) info.m_startWorldTransform = to_bullet(start_.back());
        info.m_friction = static_cast<btScalar>(body.friction);
        info.m_restitution = static_cast<btScalar>(body.restitution);
        info.m_linearDamping = info.m_angularDamping = 0;
        bodies_.push_back(std::make_unique<btRigidBody>(info));
        btRigidBody& made = *bodies_.back();
        if (dynamic) {
            made.setLinearVelocity(to_bullet(body.linear_velocity));
            made.setAngularVelocity(to_bullet(body.angular_velocity));
        }
        if (!sleep || driven_.back()) made.setActivationState(DISABLE_DEACTIVATION);
        if (driven_.back()) {
            made.setCollisionFlags((made.getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT) |
                                   btCollisionObject::CF_KINEMATIC_OBJECT);
        }
        if (body.shapes.empty()) {
            world_.addRigidBody(&made, 0, 0);  // no group: meets nothing
        } else {
            world_.addRigidBody(&made);
        }
    }

    void add_joint(const SceneJoint& joint) {
        const auto side = [this](const std::optional<std::size_t>& body) {
            if (!body) return BulletSide{btTypedConstraint::getFixedBody(), {}};
            return BulletSide{*bodies_[*body], start_[*body]};
        };
        joints_.push_back(bullet_joint(joint.def, side(joint.body_a), side(joint.body_b)));
        world_.addConstraint(joints_.back().get(), joint.body_a && joint.body_b && !joint.def.collide_connected);
    }

    const Scene& scene_;
    int substeps_;
    Real time_ = 0;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_;
    btDbvtBroadphase broad_phase_;
    btSequentialImpulseConstraintSolver solver_;
    BulletShapes shapes_;
    std::vector<std::unique_ptr<DrivenState>> driven_;  // nullptr: not kinematic
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
    std::vector<std::unique_ptr<btTypedConstraint>> joints_;
    std::vector<Quat> frames_;  // principal axes in the scene's body frame
    std::vector<Pose> start_;   // of Bullet's frames
    btDiscreteDynamicsWorld world_;
};

}  // namespace

extern "C" Rival* cairn_make_rival(const Scene& scene, const RivalOptions& options) {
    return new Bullet(scene, options);
}

}  // namespace cairn::cli
