// Stage 5: bodies that no constraint holds move exactly; kinematic bodies follow their motion.
#include "engine/world_data.hpp"

namespace cairn {
namespace {

// Rotation of a kinematic body at world time t: R(t) = exp(axis · amplitude · sin(2π t / period + phase)) R₀.
Quat motion_rotation(const BodyInfo& info, Real t) {
    const RotateSine& m = *info.motion;
    return exp_rotation(m.amplitude * std::sin(2 * kPi * (t - info.motion_time0) / m.period + m.phase) * m.axis) * info.rotation0;
}

// The rotation vector of q, of angle at most π.
Vec3 rotation_vector(const Quat& q) {
    const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
    const Real s = v.norm();
    if (s < 1e-12) return 2 * v;
    return 2 * std::atan2(s, std::abs(q.w())) / s * v;
}

}  // namespace

void drive_kinematic_bodies(WorldData& world, Real dt) {
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
        Body& body = world.bodies[i];
        if (body.type != BodyType::kKinematic || !body.alive || !body.enabled || !world.info[i].motion) continue;
        // The constant velocity that leads from where it is to where it must be at the end of the step.
        body.w = rotation_vector(motion_rotation(world.info[i], world.time + dt) * body.X_WB.q.conjugate()) / dt;
    }
}

void move_kinematic_bodies(WorldData& world, Real dt, StepReport& report) {
    for (std::uint32_t i = 0; i < world.bodies.size(); ++i) {
        Body& body = world.bodies[i];
        if (body.type != BodyType::kKinematic || !body.alive || !body.enabled) continue;
        const Quat turned =
            world.info[i].motion ? motion_rotation(world.info[i], world.time + dt) : Quat(exp_rotation(dt * body.w) * body.X_WB.q);
        accept_state(world, i, {turned, body.X_WB.p + dt * body.v}, body.v, body.w, report);
    }
    world.clock.lap(Phase::kIntegrate);
}

void move_free_bodies(WorldData& world, Real dt, StepReport& report) {
    for (std::uint32_t i = 0; i < world.bodies.size(); ++i) {
        const Body& body = world.bodies[i];
        if (!body.is_awake() || world.islands.is_member(i)) continue;
        ++report.free_bodies;
        const Vec3 a = external_acceleration(world, body);
        Pose pose{body.X_WB.q, body.X_WB.p + dt * body.v + (0.5 * dt * dt) * a};
        Vec3 w = body.w;
        const bool torque = !body.torque.isZero(0);
        if (torque) w += body.R * (body.inv_inertia_B * (body.R.transpose() * (0.5 * dt * body.torque)));
        if (!w.isZero(0)) {
            rotate_free(pose.q, w, body.rotor, dt, rotor_stages(w, dt));
            report.rotor_calls += body.rotor.kind != InertiaKind::kSpherical;
        }
        if (torque) w += pose.q * (body.inv_inertia_B * (pose.q.conjugate() * (0.5 * dt * body.torque)));
        accept_state(world, i, pose, body.v + dt * a, w, report);
    }
}

}  // namespace cairn
