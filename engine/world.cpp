// World: settings, states, views.
#include "engine/world.hpp"

#include "engine/base/error.hpp"
#include "engine/world_impl.hpp"

#include <cmath>

namespace cairn {
namespace {

void check_settings(const WorldSettings& s) {
    if (!is_finite(s.gravity)) throw Error("settings.gravity: not finite, must be three finite numbers");
    if (s.substeps < 1) throw_invalid("settings.substeps", s.substeps, ">= 1");
    if (s.iterations < 1) throw_invalid("settings.iterations", s.iterations, ">= 1");
    if (s.threads < 1) throw_invalid("settings.threads", s.threads, ">= 1");
    if (!(std::isfinite(s.residual_tolerance) && s.residual_tolerance >= 0))
        throw_invalid("settings.residual_tolerance", s.residual_tolerance, ">= 0");
    if (!(std::isfinite(s.tolerance) && s.tolerance >= 0)) throw_invalid("settings.tolerance", s.tolerance, ">= 0");
    if (!(s.model.relaxation > 0 && s.model.relaxation < 2)) throw_invalid("settings.model.relaxation", s.model.relaxation, "> 0 and < 2");
}

ContactPointView point_view(const CachedManifold& m, const PointState& p, const Transform& X_WA, const Transform& X_WB) {
    ContactPointView v;
    const SurfacePoints s = surface_points(m, p, X_WA, X_WB);
    v.position_a = s.p_a;
    v.position_b = s.p_b;
    v.anchor_a = X_WA.to_local(s.p_a);
    v.anchor_b = X_WB.to_local(s.p_b);
    v.separation = p.separation;
    v.normal_impulse = p.normal_impulse;
    v.t1 = p.t1.isZero(0) ? any_perpendicular(m.n) : p.t1;
    v.t2 = m.n.cross(v.t1);
    v.friction_impulse[0] = p.friction_impulse[0];
    v.friction_impulse[1] = p.friction_impulse[1];
    v.feature = p.feature;
    return v;
}

}  // namespace

World::World(const WorldSettings& settings) {
    check_settings(settings);
    impl_ = std::make_unique<Impl>();
    impl_->data.settings = settings;
    impl_->data.tasks = settings.tasks ? settings.tasks : make_task_system(settings.threads);
    impl_->data.workspaces.resize(impl_->data.tasks ? impl_->data.tasks->workers() : 1);
    impl_->data.narrow.resize(impl_->data.workspaces.size());
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const Body& World::Impl::body(BodyId id) const {
    if (id.is_world()) throw Error("body handle: names no body");
    if (id.index >= data.bodies.size() || data.info[id.index].generation != id.generation || !data.bodies[id.index].alive)
        throw Error("body handle " + std::to_string(id.index) + "/" + std::to_string(id.generation) +
                    ": stale, the body was removed or is of another world");
    return data.bodies[id.index];
}

const Joint& World::Impl::joint(JointId id) const {
    if (id.index >= data.joints.size() || data.joints[id.index].generation != id.generation || !data.joints[id.index].alive)
        throw Error("joint handle " + std::to_string(id.index) + "/" + std::to_string(id.generation) +
                    ": stale, the joint was removed or is of another world");
    return data.joints[id.index];
}

Real World::time() const {
    return impl_->data.time;
}
const WorldSettings& World::settings() const {
    return impl_->data.settings;
}

void World::set_gravity(const Vec3& gravity) {
    if (!is_finite(gravity)) throw Error("gravity: not finite, must be three finite numbers");
    impl_->data.settings.gravity = gravity;
    for (std::uint32_t i = 0; i < impl_->data.bodies.size(); ++i) wake_group(impl_->data, i);
}

BodyState World::state(BodyId id) const {
    const Body& b = impl_->body(id);
    return {b.X_WB.p, b.X_WB.q, b.v, b.w};
}

void World::set_state(BodyId id, const BodyState& s) {
    Body& b = impl_->body(id);
    if (!is_finite(s.position) || !is_finite(s.rotation) || !is_normalisable(s.rotation.norm()) || !is_finite(s.linear_velocity) ||
        !is_finite(s.angular_velocity))
        throw Error("state of body \"" + name(id) + "\": must be finite, with a rotation that is not zero");
    for (std::uint32_t k = b.shape_begin; k < b.shape_begin + b.shape_count; ++k)
        if (impl_->data.shapes[k].shape.type == ShapeType::kPlane)
            throw Error("state of body \"" + name(id) + "\": a body with a plane cannot be moved");
    wake_group(impl_->data, id.index);
    wake_neighbours(impl_->data, id.index);
    const Quat q = s.rotation.normalized();
    b.turned += turn_way(b.X_WB.q, q);
    b.X_WB = {q, s.position};
    b.R = b.X_WB.q.toRotationMatrix();
    if (b.type != BodyType::kStatic) {
        b.v = s.linear_velocity;
        b.w = s.angular_velocity;
    }
    mark_moved(impl_->data, id.index);
}

void World::set_force(BodyId id, const Vec3& force, const Vec3& torque) {
    Body& b = impl_->body(id);
    if (!is_finite(force) || !is_finite(torque)) throw Error("force on body \"" + name(id) + "\": must be finite");
    if (b.type != BodyType::kDynamic) throw Error("force on body \"" + name(id) + "\": must be a dynamic body");
    if (b.force == force && b.torque == torque) return;
    b.force = force;
    b.torque = torque;
    b.has_load = !(force.isZero(0) && torque.isZero(0));
    wake_group(impl_->data, id.index);
}

void World::apply_impulse(BodyId id, const Vec3& impulse, const Vec3& point) {
    Body& b = impl_->body(id);
    if (!is_finite(impulse) || !is_finite(point)) throw Error("impulse on body \"" + name(id) + "\": must be finite");
    if (b.type != BodyType::kDynamic) throw Error("impulse on body \"" + name(id) + "\": must be a dynamic body");
    b.v += b.inv_mass * impulse;
    b.w += b.R * (b.inv_inertia_B * (b.R.transpose() * (point - b.X_WB.p).cross(impulse)));
    wake_group(impl_->data, id.index);
}

BodyType World::type(BodyId id) const {
    return impl_->body(id).type;
}
Real World::mass(BodyId id) const {
    impl_->body(id);
    return impl_->data.info[id.index].mass;
}
Mat3 World::inertia(BodyId id) const {
    impl_->body(id);
    return impl_->data.info[id.index].inertia_B;
}
const std::string& World::name(BodyId id) const {
    impl_->body(id);
    return impl_->data.info[id.index].name;
}
bool World::is_sleeping(BodyId id) const {
    return impl_->body(id).asleep;
}
bool World::is_enabled(BodyId id) const {
    return impl_->body(id).enabled;
}
void World::wake(BodyId id) {
    impl_->body(id);
    wake_group(impl_->data, id.index);
}

std::vector<BodyId> World::bodies() const {
    std::vector<BodyId> out;
    for (std::uint32_t i = 0; i < impl_->data.bodies.size(); ++i)
        if (impl_->data.bodies[i].alive) out.push_back({i, impl_->data.info[i].generation});
    return out;
}

std::size_t World::body_count() const {
    return impl_->data.bodies.size() - impl_->data.free_bodies.size();
}
std::size_t World::joint_count() const {
    return impl_->data.joints.size() - impl_->data.free_joints.size();
}

std::vector<ManifoldView> World::manifolds() const {
    const WorldData& world = impl_->data;
    std::vector<ManifoldView> out;
    for (const Contact& c : world.contacts.slots()) {
        for (int i = 0; c.alive && i < c.manifold_count; ++i) {
            const CachedManifold& m = c.manifold(i);
            if (m.count == 0) continue;
            ManifoldView v;
            v.body_a = {c.body_a, world.info[c.body_a].generation};
            v.body_b = {c.body_b, world.info[c.body_b].generation};
            v.shape_a = static_cast<int>(world.shapes[c.shape_a].index);
            v.shape_b = static_cast<int>(world.shapes[c.shape_b].index);
            v.n = m.n;
            v.friction = c.mu;
            v.restitution = c.restitution;
            v.count = m.count;
            for (int k = 0; k < m.count; ++k)
                v.points[k] = point_view(m, m.points[k], world.bodies[c.body_a].transform(), world.bodies[c.body_b].transform());
            out.push_back(v);
        }
    }
    return out;
}

Real World::kinetic_energy() const {
    return cairn::kinetic_energy(impl_->data);
}

Real World::potential_energy() const {
    Real energy = 0;
    for (std::size_t i = 0; i < impl_->data.bodies.size(); ++i) {
        const Body& b = impl_->data.bodies[i];
        if (b.type == BodyType::kDynamic && b.alive) energy -= impl_->data.info[i].mass * impl_->data.settings.gravity.dot(b.X_WB.p);
    }
    return energy;
}

}  // namespace cairn
