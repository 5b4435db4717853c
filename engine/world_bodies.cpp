// Adding, removing and disabling bodies.
#include "collision/extent.hpp"
#include "collision/mass_properties.hpp"
#include "collision/mesh.hpp"
#include "engine/base/error.hpp"
#include "engine/world_impl.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn {
namespace {

std::string label(const BodyDef& def) {
    return def.name.empty() ? std::string("body") : "body \"" + def.name + "\"";
}

void require_finite(const std::string& what, const Vec3& v) {
    if (!is_finite(v)) throw Error(what + ": not finite, must be three finite numbers");
}

void require_at_least_zero(const std::string& what, Real v) {
    if (!(std::isfinite(v) && v >= 0)) throw_invalid(what, v, ">= 0");
}

void check_motion(const std::string& who, const BodyDef& def) {
    if (!def.motion) return;
    const RotateSine& m = *def.motion;
    if (def.type != BodyType::kKinematic) throw Error(who + ".motion: only kinematic bodies have one");
    if (!is_finite(m.axis) || !is_normalisable(m.axis.norm())) throw Error(who + ".motion.axis: must be finite and neither zero nor huge");
    if (!(std::isfinite(m.period) && m.period > 0)) throw_invalid(who + ".motion.period", m.period, "> 0");
    if (!std::isfinite(m.amplitude)) throw_invalid(who + ".motion.amplitude", m.amplitude, "finite");
    if (!std::isfinite(m.phase)) throw_invalid(who + ".motion.phase", m.phase, "finite");
}

void check_definition(const BodyDef& def) {
    const std::string who = label(def);
    require_finite(who + ".position", def.position);
    require_finite(who + ".linear_velocity", def.linear_velocity);
    require_finite(who + ".angular_velocity", def.angular_velocity);
    require_finite(who + ".force", def.force);
    require_finite(who + ".torque", def.torque);
    if (!is_finite(def.rotation) || !is_normalisable(def.rotation.norm()))
        throw Error(who + ".rotation: must be a finite quaternion that is neither zero nor huge");
    require_at_least_zero(who + ".friction", def.friction);
    require_at_least_zero(who + ".restitution", def.restitution);
    require_at_least_zero(who + ".torsional_friction", def.torsional_friction);
    require_at_least_zero(who + ".rolling_friction", def.rolling_friction);
    check_motion(who, def);
    for (std::size_t i = 0; i < def.shapes.size(); ++i)
        if (def.shapes[i].is_static_only() && def.type != BodyType::kStatic)
            throw Error(who + ".shapes[" + std::to_string(i) + "]: planes and meshes belong to static bodies only");
    if (def.type != BodyType::kDynamic) return;
    if (!(std::isfinite(def.mass) && def.mass > 0)) throw_invalid(who + ".mass", def.mass, "> 0");
    if (!def.inertia) return;
    const Vec3& I = *def.inertia;
    for (int k = 0; k < 3; ++k) {
        if (!(std::isfinite(I[k]) && I[k] > 0)) throw_invalid(who + ".inertia[" + std::to_string(k) + "]", I[k], "> 0");
        if (I[k] > (I[(k + 1) % 3] + I[(k + 2) % 3]) * (1 + 1e-6))
            throw_invalid(who + ".inertia[" + std::to_string(k) + "]", I[k], "at most the sum of the other two");
    }
}

// Inertia about the centre of mass in the body frame [kg m²].
Mat3 body_inertia(const BodyDef& def) {
    if (def.inertia) return def.inertia->asDiagonal();
    const std::string who = label(def);
    const VolumeProperties p = volume_properties(def.shapes);
    if (!(p.volume > 0)) throw Error(who + ".inertia: missing, must be given for a dynamic body without shapes that have volume");
    const Real scale = std::sqrt(p.inertia.trace() / p.volume);
    if (p.centroid.norm() > 1e-4 * scale)
        throw_invalid(who + ": the shapes' centroid lies off the origin by", p.centroid.norm(),
                      "0 (the origin is the centre of mass) unless inertia is given");
    Mat3 I = def.mass / p.volume * p.inertia;
    const Real tiny = 1e-9 * I.cwiseAbs().maxCoeff();
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            if (r != c && std::abs(I(r, c)) < tiny) I(r, c) = 0;
    return I;
}

// 0 for what belongs to static bodies.
Real radius_of(const Shape& s) {
    return s.is_static_only() ? 0 : bounding_radius(s);
}

// Of a ball about the middle of the shape's box that holds the shape.
Real ball_radius(const Shape& s) {
    const bool is_symmetric = s.type != ShapeType::kHull && !s.is_static_only();
    Shape centred = s;
    centred.X_BS = Pose();
    return is_symmetric ? bounding_radius(centred) : std::numeric_limits<Real>::infinity();
}

std::uint32_t take_shape_block(WorldData& world, std::uint32_t count) {
    auto& free = world.free_shape_blocks[count];
    if (!free.empty()) {
        const std::uint32_t begin = free.back();
        free.pop_back();
        return begin;
    }
    const std::uint32_t begin = static_cast<std::uint32_t>(world.shapes.size());
    world.shapes.resize(world.shapes.size() + count);
    return begin;
}

void add_shapes(WorldData& world, std::uint32_t index, const std::vector<Shape>& shapes) {
    Body& body = world.bodies[index];
    body.shape_count = static_cast<std::uint32_t>(shapes.size());
    body.shape_begin = take_shape_block(world, body.shape_count);
    body.radius = 0;
    for (std::uint32_t i = 0; i < body.shape_count; ++i) {
        ShapeRecord record;
        record.shape = shapes[i];
        record.body = index;
        record.index = i;
        record.X_BS = Transform(shapes[i].X_BS);
        record.at_body = record.X_BS.R == Mat3::Identity() && record.X_BS.p == Vec3::Zero();
        record.size = least_extent(shapes[i]);
        record.spin_radius = shapes[i].type == ShapeType::kSphere ? shapes[i].X_BS.p.norm() : radius_of(shapes[i]);
        body.radius = std::max(body.radius, radius_of(shapes[i]));
        if (shapes[i].type == ShapeType::kPlane) {
            // Solid where normal·x <= offset in the body frame.
            const Vec3 n = body.R * shapes[i].normal;
            record.proxy = world.broad_phase.add_plane(n, shapes[i].offset + n.dot(body.X_WB.p), body.shape_begin + i);
        } else {
            record.proxy = world.broad_phase.add(shape_aabb(shapes[i], record.pose(body.transform())), body.type == BodyType::kStatic,
                                                 body.shape_begin + i);
        }
        world.shapes[body.shape_begin + i] = record;
    }
    world.motions.resize(world.shapes.size());
    note_motion(world, body, 0);
    for (std::uint32_t i = 0; i < body.shape_count; ++i) world.motions[body.shape_begin + i].ball = ball_radius(shapes[i]);
}

void remove_shapes(WorldData& world, std::uint32_t index) {
    Body& body = world.bodies[index];
    for (std::uint32_t s = body.shape_begin; s < body.shape_begin + body.shape_count; ++s) {
        if (world.shapes[s].proxy != kNoProxy) world.broad_phase.remove(world.shapes[s].proxy);
        world.shapes[s].proxy = kNoProxy;
    }
}

// Ends the contacts of a body; those that slept on it wake.
void remove_contacts(WorldData& world, std::uint32_t index) {
    world.active.contact_links.for_each(index, [&](std::uint32_t slot, std::uint32_t other) {
        wake_group(world, other);
        end_contact(world, slot);
    });
}

}  // namespace

BodyId World::add_body(const BodyDef& def) {
    check_definition(def);
    WorldData& world = impl_->data;
    Body body;
    BodyInfo info;
    body.type = def.type;
    body.X_WB = {def.rotation.normalized(), def.position};
    body.v = def.linear_velocity;
    body.w = def.angular_velocity;
    if (def.type == BodyType::kDynamic) {
        info.mass = def.mass;
        info.inertia_B = body_inertia(def);
        const PrincipalInertia principal = principal_inertia(info.inertia_B);
        body.inv_mass = 1 / def.mass;
        body.inv_inertia_B = info.inertia_B.inverse();
        body.rotor = make_rotor_inertia(principal.moments, principal.R_BP);
        body.is_spherical = body.rotor.kind == InertiaKind::kSpherical;
        body.force = def.force;
        body.torque = def.torque;
        body.has_load = !(def.force.isZero(0) && def.torque.isZero(0));
    } else if (def.type == BodyType::kStatic) {
        body.v.setZero();
        body.w.setZero();
    }
    info.name = def.name;
    info.friction = def.friction;
    info.restitution = def.restitution;
    info.torsional_friction = def.torsional_friction;
    info.rolling_friction = def.rolling_friction;
    world.has_spin_friction |= def.torsional_friction > 0 || def.rolling_friction > 0;
    if (def.motion) {
        info.motion = def.motion;
        info.motion->axis.normalize();
        info.rotation0 = body.X_WB.q;
        info.motion_time0 = world.time;
        body.X_WB.q = exp_rotation(info.motion->amplitude * std::sin(info.motion->phase) * info.motion->axis) * body.X_WB.q;
        body.v.setZero();
        body.w.setZero();
    }
    body.R = body.X_WB.q.toRotationMatrix();

    std::uint32_t index;
    if (world.free_bodies.empty()) {
        index = static_cast<std::uint32_t>(world.bodies.size());
        world.bodies.push_back(body);
        world.info.push_back(info);
    } else {
        index = world.free_bodies.back();
        world.free_bodies.pop_back();
        info.generation = world.info[index].generation;
        world.bodies[index] = body;
        world.info[index] = info;
    }
    add_shapes(world, index, def.shapes);
    activate(world, index);
    return {index, info.generation};
}

void World::remove_body(BodyId id) {
    WorldData& world = impl_->data;
    Body& body = impl_->body(id);
    for (std::uint32_t k = 0; k < world.joints.size(); ++k) {
        const Joint& j = world.joints[k];
        if (j.alive && (j.body_a == id.index || j.body_b == id.index)) remove_joint({k, j.generation});
    }
    wake_group(world, id.index);
    remove_contacts(world, id.index);
    remove_shapes(world, id.index);
    world.active.has_stopped = true;
    flush_broad_phase(world);
    world.free_shape_blocks[body.shape_count].push_back(body.shape_begin);
    body.alive = false;
    body.enabled = false;
    body.asleep = false;
    body.shape_count = 0;
    ++world.info[id.index].generation;
    world.free_bodies.push_back(id.index);
}

void disable_body(WorldData& world, std::uint32_t index) {
    remove_contacts(world, index);
    remove_shapes(world, index);
    world.active.has_stopped = true;
    Body& body = world.bodies[index];
    body.enabled = false;
    body.asleep = false;
    body.v.setZero();
    body.w.setZero();
}

bool accept_state(Body& body, const Pose& pose, const Vec3& v, const Vec3& w) {
    if (!(is_finite(pose.p) && is_finite(pose.q) && is_finite(v) && is_finite(w))) return false;
    const Quat q = pose.q.normalized();
    body.turned += turn_way(body.X_WB.q, q);
    body.X_WB = {q, pose.p};
    body.R = body.X_WB.q.toRotationMatrix();
    body.v = v;
    body.w = w;
    return true;
}

void disable_broken(WorldData& world, StepReport& report) {
    std::sort(world.broken.begin(), world.broken.end());
    for (const std::uint32_t body : world.broken) {
        disable_body(world, body);
        ++report.bodies_disabled;
        report.ok = false;
    }
    world.broken.clear();
}

}  // namespace cairn
