// Stage 5: bodies that no constraint holds move exactly; kinematic bodies follow their motion.
#include "engine/error_control.hpp"
#include "engine/world_data.hpp"
#include "solver/short_turn.hpp"

#include <algorithm>

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
    for (const std::uint32_t i : world.active.kinematic.numbers()) {
        Body& body = world.bodies[i];
        // The constant velocity that leads from where it is to where it must be at the end of the step.
        if (world.info[i].motion) body.w = rotation_vector(motion_rotation(world.info[i], world.time + dt) * body.X_WB.q.conjugate()) / dt;
        if (is_moving(body) == body.was_moving) continue;
        body.was_moving = !body.was_moving;
        if (body.was_moving) activate(world, i);
        world.active.has_stopped |= !body.was_moving;
    }
}

void move_kinematic_bodies(WorldData& world, Real dt, StepReport& report) {
    for (const std::uint32_t i : world.active.kinematic.numbers()) {
        Body& body = world.bodies[i];
        if (!is_moving(body) && !world.info[i].motion) continue;
        const Quat turned =
            world.info[i].motion ? motion_rotation(world.info[i], world.time + dt) : Quat(exp_rotation(dt * body.w) * body.X_WB.q);
        if (!accept_state(body, {turned, body.X_WB.p + dt * body.v}, body.v, body.w)) world.broken.push_back(i);
    }
    disable_broken(world, report);
    world.clock.lap(Phase::kIntegrate);
}

namespace {

// With a force or torque of its own: half-kicks about the free rotation. False if that leads out of the finite numbers.
bool move_loaded(const WorldData& world, Body& body, Real dt, StepReport& report) {
    const Vec3 a = external_acceleration(world, body);
    Pose pose{body.X_WB.q, body.X_WB.p + dt * body.v + (0.5 * dt * dt) * a};
    Vec3 w = body.w + body.R * (body.inv_inertia_B * (body.R.transpose() * (0.5 * dt * body.torque)));
    if (!w.isZero(0)) {
        rotate_free(pose.q, w, body.rotor, dt, rotor_stages(w, dt));
        report.rotor_calls += !body.is_spherical;
    }
    w += pose.q * (body.inv_inertia_B * (pose.q.conjugate() * (0.5 * dt * body.torque)));
    return accept_state(body, pose, body.v + dt * a, w);
}

// The same under gravity alone, for the many. fall: ½ g dt², gain: g dt.
bool move_falling(Body& body, const Vec3& fall, const Vec3& gain, Real dt, StepReport& report) {
    Pose pose{body.X_WB.q, body.X_WB.p + dt * body.v + fall};
    const Vec3 v = body.v + gain;
    Vec3 w = body.w;
    const bool turns = !w.isZero(0);
    if (turns && body.is_spherical) {
        rotate_spherical(pose.q, w, dt);
    } else if (turns) {
        rotate_free(pose.q, w, body.rotor, dt, rotor_stages(w, dt));
        ++report.rotor_calls;
    }
    // Finite where the sum is; else each number is looked at.
    if (!std::isfinite(pose.p.sum() + v.sum() + w.sum() + pose.q.coeffs().sum())) return accept_state(body, pose, v, w);
    if (turns) body.turned += turn_way(body.X_WB.q, pose.q);
    body.X_WB = pose;
    body.v = v;
    body.w = w;
    if (turns) body.R = pose.q.toRotationMatrix();
    return true;
}

}  // namespace

void move_free_bodies(WorldData& world, Real dt, StepReport& report) {
    const Vec3 fall = (0.5 * dt * dt) * world.settings.gravity, gain = dt * world.settings.gravity;
    const std::vector<std::uint32_t>& bodies = world.active.bodies.numbers();
    constexpr std::size_t kPiece = 256;
    for_pieces(world.team, bodies.size(), kPiece, [&](std::size_t begin, std::size_t end, int worker) {
        IslandWorkspace& work = world.workspaces[worker];
        for (std::size_t k = begin; k < end; ++k) {
            Body& body = world.bodies[bodies[k]];
            if (!body.is_awake() || world.islands.is_member(bodies[k])) continue;
            ++work.report.free_bodies;
            if (world.settings.tolerance > 0 && needs_error_control(body)) {
                if (!move_to_tolerance(world, work, bodies[k], dt)) work.broken.push_back(bodies[k]);
                continue;
            }
            if (!(body.has_load ? move_loaded(world, body, dt, work.report) : move_falling(body, fall, gain, dt, work.report)))
                work.broken.push_back(bodies[k]);
        }
    });
    for (IslandWorkspace& work : world.workspaces) {
        report.free_bodies += work.report.free_bodies;
        report.rotor_calls += work.report.rotor_calls;
        take_error_report(work.report, report);
        world.broken.insert(world.broken.end(), work.broken.begin(), work.broken.end());
        work.report = {};
        work.broken.clear();
    }
    disable_broken(world, report);
}

}  // namespace cairn
