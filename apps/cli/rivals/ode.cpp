// ODE, the Open Dynamics Engine: QuickStep as it comes (20 sweeps); variant `worldstep` takes its direct solver instead, `fdir` turns the
// friction pyramid along the slip (ODE leaves its direction to the caller). Friction of a pair √(μ_a μ_b), restitution the larger one.
#include "apps/cli/rivals/module.hpp"
#include "apps/cli/rivals/ode_shapes.hpp"
#include "apps/cli/rivals/parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <set>
#include <utility>

namespace cairn::cli {

namespace {

constexpr int kMostContacts = 32;  // of a pair of geoms

// ODE would print and abort the program.
[[noreturn]] void give_up(int, const char* format, va_list arguments) {
    char text[256];
    std::vsnprintf(text, sizeof text, format, arguments);
    throw Error(std::string("ode: ") + text);
}
void be_quiet(int, const char*, va_list) {}

void set_rotation(dBodyID body, const Quat& q) {
    const dQuaternion values = {q.w(), q.x(), q.y(), q.z()};
    dBodySetQuaternion(body, values);
}
Vec3 vec3(const dReal* v) {
    return {v[0], v[1], v[2]};
}

class Ode : public Rival {
public:
    Ode(const Scene& scene, const RivalOptions& options)
        : scene_(scene),
          substeps_(options.substeps.value_or(1)),
          direct_(options.variant == "worldstep"),
          along_slip_(options.variant == "fdir") {
        if (!options.variant.empty() && !direct_ && !along_slip_) throw_invalid("variant", options.variant, "worldstep or fdir");
        refuse_what_no_adapter_has(scene);
        refuse_what_ode_lacks();
        start_library();
        world_ = dWorldCreate();
        space_ = dHashSpaceCreate(nullptr);
        contact_joints_ = dJointGroupCreate(0);
        dWorldSetGravity(world_, scene.gravity.x(), scene.gravity.y(), scene.gravity.z());
        if (options.iterations) dWorldSetQuickStepNumIterations(world_, *options.iterations);
        dWorldSetAutoDisableFlag(world_, options.sleep ? 1 : 0);
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) add_body(i);
        for (const SceneJoint& joint : scene.joints) add_joint(joint);
    }
    ~Ode() override {
        dJointGroupDestroy(contact_joints_);
        dSpaceDestroy(space_);
        dWorldDestroy(world_);
    }

    std::string version() const override { return CAIRN_ODE_VERSION; }
    int precision() const override { return 8 * static_cast<int>(sizeof(dReal)); }
    std::string settings() const override {
        const std::string solver =
            direct_ ? "WorldStep (direct)" : fmt::format("QuickStep, {} iterations", dWorldGetQuickStepNumIterations(world_));
        return fmt::format("{} substeps, {}, erp {}, cfm {}, friction pyramid{}, <= {} contacts a pair, restitution at any speed, no ccd",
                           substeps_, solver, dWorldGetERP(world_), dWorldGetCFM(world_), along_slip_ ? " along the slip" : "",
                           kMostContacts);
    }

    void step(Real dt) override {
        const Real h = dt / substeps_;
        for (int k = 0; k < substeps_; ++k) {
            const Real now = time_ + k * h;
            drive(now, h);
            contacts_ = 0;
            dSpaceCollide(space_, this, near_pair);
            const int well = direct_ ? dWorldStep(world_, h) : dWorldQuickStep(world_, h);
            dJointGroupEmpty(contact_joints_);
            if (well == 0) throw Error("ode: out of memory");
            for (std::size_t i = 0; i < bodies_.size(); ++i) {
                if (scene_.bodies[i].type == BodyType::kKinematic) place(i, driven_pose(scene_.bodies[i], now + h));
            }
        }
        time_ += dt;
    }

    void states(std::vector<BodyState>& out) const override {
        out.clear();
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            if (bodies_[i] == nullptr) {
                out.push_back({scene_.bodies[i].position, scene_.bodies[i].rotation, Vec3::Zero(), Vec3::Zero()});
                continue;
            }
            const dReal* q = dBodyGetQuaternion(bodies_[i]);
            out.push_back({vec3(dBodyGetPosition(bodies_[i])), Quat(q[0], q[1], q[2], q[3]), vec3(dBodyGetLinearVel(bodies_[i])),
                           vec3(dBodyGetAngularVel(bodies_[i]))});
        }
    }

    int contacts() const override { return contacts_; }

private:
    static void start_library() {
        static const bool well = [] {
            dSetDebugHandler(give_up);
            dSetErrorHandler(give_up);
            dSetMessageHandler(be_quiet);
            return dInitODE2(0) != 0 && dCheckConfiguration(sizeof(dReal) == 8 ? "ODE_double_precision" : "ODE_single_precision") == 1;
        }();
        if (!well) throw Error("ode: its headers and its library differ in precision");
    }

    void refuse_what_ode_lacks() const {
        bool hull = false, mesh = false;
        for (const BodyDef& body : scene_.bodies) {
            for (const Shape& s : body.shapes) {
                hull = hull || s.type == ShapeType::kHull;
                mesh = mesh || s.type == ShapeType::kMesh;
            }
        }
        if (hull && mesh) throw Unsupported("convex hulls against a mesh");  // ODE 0.16 crashes on such a pair
    }

    void place(std::size_t i, const Pose& X) {
        dBodySetPosition(bodies_[i], X.p.x(), X.p.y(), X.p.z());
        set_rotation(bodies_[i], X.q);
    }

    void add_body(std::size_t i) {
        const BodyDef& body = scene_.bodies[i];
        const Pose X = body.type == BodyType::kKinematic ? driven_pose(body, 0) : Pose{body.rotation.normalized(), body.position};
        bodies_.push_back(body.type == BodyType::kStatic ? nullptr : dBodyCreate(world_));
        dBodyID made = bodies_.back();
        if (made != nullptr) place(i, X);
        if (body.type == BodyType::kDynamic) {
            const Mat3 I = inertia_of(body);
            dMass mass;
            dMassSetParameters(&mass, body.mass, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
            dBodySetMass(made, &mass);
            dBodySetLinearVel(made, body.linear_velocity.x(), body.linear_velocity.y(), body.linear_velocity.z());
            dBodySetAngularVel(made, body.angular_velocity.x(), body.angular_velocity.y(), body.angular_velocity.z());
        } else if (made != nullptr) {
            dBodySetKinematic(made);
            dBodySetAutoDisableFlag(made, 0);
        }
        for (const Shape& shape : body.shapes) add_shape(i, shape, X);
    }

    void add_shape(std::size_t i, const Shape& shape, const Pose& X_WB) {
        const dGeomID geom = shapes_.add(space_, shape, X_WB);
        dGeomSetData(geom, reinterpret_cast<void*>(i));
        if (shape.type == ShapeType::kPlane) return;
        if (bodies_[i] != nullptr) dGeomSetBody(geom, bodies_[i]);
        const Pose X = bodies_[i] != nullptr ? shape.X_BS : X_WB * shape.X_BS;
        const dQuaternion q = {X.q.w(), X.q.x(), X.q.y(), X.q.z()};
        if (bodies_[i] == nullptr) {
            dGeomSetPosition(geom, X.p.x(), X.p.y(), X.p.z());
            dGeomSetQuaternion(geom, q);
        } else if (!X.p.isZero(0) || !X.q.vec().isZero(0)) {
            dGeomSetOffsetPosition(geom, X.p.x(), X.p.y(), X.p.z());
            dGeomSetOffsetQuaternion(geom, q);
        }
    }

    void add_joint(const SceneJoint& joint) {
        const JointDef& j = joint.def;
        const dBodyID a = joint.body_a ? bodies_[*joint.body_a] : nullptr, b = joint.body_b ? bodies_[*joint.body_b] : nullptr;
        if (joint.body_a && joint.body_b && !j.collide_connected) apart_.insert(std::minmax(*joint.body_a, *joint.body_b));
        if (a == nullptr && b == nullptr) return;
        const Vec3 &p = j.anchor_a, u = j.axis.normalized();
        switch (j.type) {
            case JointType::kBall: {
                const dJointID made = attached(dJointCreateBall(world_, nullptr), a, b);
                dJointSetBallAnchor(made, p.x(), p.y(), p.z());
                break;
            }
            case JointType::kHinge: {
                const dJointID made = attached(dJointCreateHinge(world_, nullptr), a, b);
                dJointSetHingeAnchor(made, p.x(), p.y(), p.z());
                dJointSetHingeAxis(made, u.x(), u.y(), u.z());
                break;
            }
            case JointType::kSlider: {
                const dJointID made = attached(dJointCreateSlider(world_, nullptr), a, b);
                dJointSetSliderAxis(made, u.x(), u.y(), u.z());
                break;
            }
            case JointType::kFixed:
                dJointSetFixed(attached(dJointCreateFixed(world_, nullptr), a, b));
                break;
            case JointType::kDistance: {
                const dJointID made = attached(dJointCreateDBall(world_, nullptr), a, b);
                dJointSetDBallAnchor1(made, p.x(), p.y(), p.z());
                dJointSetDBallAnchor2(made, j.anchor_b.x(), j.anchor_b.y(), j.anchor_b.z());
                dJointSetDBallDistance(made, (j.anchor_a - j.anchor_b).norm());
                break;
            }
        }
    }
    static dJointID attached(dJointID joint, dBodyID a, dBodyID b) {
        dJointAttach(joint, a, b);
        return joint;
    }

    // Forces for this substep, and the velocities that take kinematic bodies to where they are to be at its end.
    void drive(Real now, Real h) {
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            const BodyDef& body = scene_.bodies[i];
            if (body.type == BodyType::kDynamic) {
                if (!body.force.isZero(0)) dBodyAddForce(bodies_[i], body.force.x(), body.force.y(), body.force.z());
                if (!body.torque.isZero(0)) dBodyAddTorque(bodies_[i], body.torque.x(), body.torque.y(), body.torque.z());
            } else if (body.type == BodyType::kKinematic) {
                const auto [v, w] = velocity_between(driven_pose(body, now), driven_pose(body, now + h), h);
                dBodySetLinearVel(bodies_[i], v.x(), v.y(), v.z());
                dBodySetAngularVel(bodies_[i], w.x(), w.y(), w.z());
            }
        }
    }

    static void near_pair(void* self, dGeomID a, dGeomID b) { static_cast<Ode*>(self)->collide(a, b); }

    void collide(dGeomID a, dGeomID b) {
        const std::size_t i = reinterpret_cast<std::size_t>(dGeomGetData(a)), j = reinterpret_cast<std::size_t>(dGeomGetData(b));
        const BodyDef &x = scene_.bodies[i], &y = scene_.bodies[j];
        if (i == j || (x.type != BodyType::kDynamic && y.type != BodyType::kDynamic) || apart_.count(std::minmax(i, j)) != 0) return;
        dContact found[kMostContacts];
        const int count = dCollide(a, b, kMostContacts, &found[0].geom, sizeof(dContact));
        const Real restitution = std::max(x.restitution, y.restitution);
        for (int k = 0; k < count; ++k) {
            dContact& c = found[k];
            if (!(vec3(c.geom.normal).squaredNorm() > 0.5)) continue;  // pairs that just touch may have none, on which ODE would stop
            c.surface.mode = dContactApprox1 | (restitution > 0 ? dContactBounce : 0);
            c.surface.mu = std::sqrt(x.friction * y.friction);
            c.surface.bounce = restitution;
            c.surface.bounce_vel = 0;
            if (along_slip_) point_along_slip(c, dGeomGetBody(a), dGeomGetBody(b));
            dJointAttach(dJointCreateContact(world_, contact_joints_, &c), dGeomGetBody(a), dGeomGetBody(b));
            ++contacts_;
        }
    }

    static Vec3 point_velocity(dBodyID body, const dReal* p) {
        dVector3 v = {0, 0, 0, 0};
        if (body != nullptr) dBodyGetPointVel(body, p[0], p[1], p[2], v);
        return vec3(v);
    }
    static void point_along_slip(dContact& c, dBodyID a, dBodyID b) {
        const Vec3 n = vec3(c.geom.normal), v = point_velocity(a, c.geom.pos) - point_velocity(b, c.geom.pos);
        const Vec3 slip = v - v.dot(n) * n;
        if (slip.norm() < 1e-6) return;
        c.surface.mode |= dContactFDir1;
        for (int k = 0; k < 3; ++k) c.fdir1[k] = slip[k] / slip.norm();
    }

    const Scene& scene_;
    int substeps_;
    bool direct_, along_slip_;
    Real time_ = 0;
    int contacts_ = 0;
    OdeShapes shapes_;
    dWorldID world_ = nullptr;
    dSpaceID space_ = nullptr;
    dJointGroupID contact_joints_ = nullptr;
    std::vector<dBodyID> bodies_;                          // nullptr: static
    std::set<std::pair<std::size_t, std::size_t>> apart_;  // pairs that a joint keeps from colliding
};

}  // namespace

extern "C" Rival* cairn_make_rival(const Scene& scene, const RivalOptions& options) {
    return new Ode(scene, options);
}

}  // namespace cairn::cli
