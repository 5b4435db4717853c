#include "engine/error_control.hpp"

#include "engine/base/hash.hpp"

namespace cairn {
namespace {

constexpr int kLongestInterval = 32;
// By how much the error is taken to grow from a level to the one below, before that has been seen.
constexpr Real kGrowth = 64;
// Room for what the error does until it is measured again.
constexpr Real kRoom = 2;

// Of a body without shapes: that of gyration.
template <typename AnyBody>
Real radius_of(const AnyBody& b) {
    return std::max(b.radius, std::sqrt(b.rotor.moments.maxCoeff() * b.inv_mass));
}

// [s], for which an error of velocity is taken to last: where forces turn it back, and in free flight.
constexpr Real kLasting = 0.2;
constexpr Real kLastingFree = 1;

std::uint64_t signature_of(const WorldData& world, int index) {
    const IslandBuilder& islands = world.islands;
    Hasher h;
    const IndexRange bodies = islands.bodies(index), contacts = islands.items(index, IslandBuilder::kContact),
                     joints = islands.items(index, IslandBuilder::kJoint);
    h.add_word(static_cast<std::uint64_t>(bodies.end - bodies.begin));
    h.add_word(static_cast<std::uint64_t>(joints.end - joints.begin));
    for (int k = contacts.begin; k < contacts.end; ++k) {
        const Contact& c = world.contacts.slots()[islands.item_list(IslandBuilder::kContact)[k]];
        h.add_word(c.shape_a), h.add_word(c.shape_b), h.add_word(static_cast<std::uint64_t>(c.point_count));
    }
    return h.value() | 1;  // 0: free
}

// e of a point of the body at `radius`, but for what the centre does.
Real turn_error(const Quat& q1, const Vec3& w1, const Quat& q2, const Vec3& w2, Real radius, Real lasting) {
    return radius * (2 * (q1.conjugate() * q2).vec().norm() + lasting * (w1 - w2).norm());
}

void begin_anew(ErrorControl& control) {
    control.level = 0;
    control.gained = 0;
    control.interval = 1;
}

struct Turned {
    Quat q;
    Vec3 w;
};

Turned turn_free(const Body& body, Real dt, int level) {
    Turned t{body.X_WB.q, body.w};
    if (body.torque.isZero(0)) {
        rotate_free(t.q, t.w, body.rotor, dt, level == 0 ? 1 : 5 << (level - 1));
        return t;
    }
    const Real h = dt / (1 << level);
    const auto kick = [&] { t.w += t.q * (body.inv_inertia_B * (t.q.conjugate() * (0.5 * h * body.torque))); };
    for (int k = 0; k < 1 << level; ++k) {
        kick();
        rotate_free(t.q, t.w, body.rotor, h, 1);
        kick();
    }
    return t;
}

Turned turn_to_tolerance(WorldData& world, const Body& body, ErrorControl& control, Real dt, StepReport& report) {
    constexpr Real kMoreSpeed = 1.1;
    const Real admitted = world.settings.tolerance * dt, speed = body.w.norm();
    const bool due = --control.steps_left < 0 || control.disturbed || control.signature != 0 || speed > kMoreSpeed * control.jump;
    if (control.signature != 0) begin_anew(control);
    control.signature = 0;
    control.disturbed = false;
    Turned coarse = turn_free(body, dt, control.level);
    ++report.rotor_calls;
    if (!due) return coarse;
    control.jump = speed;
    const auto attempt = [&](int level) {
        const Turned fine = turn_free(body, dt, level);
        ++report.rotor_calls;
        const Real error = turn_error(coarse.q, coarse.w, fine.q, fine.w, radius_of(body), kLastingFree);
        coarse = fine;
        return error;
    };
    refine(control, admitted, report, attempt);
    return coarse;
}

}  // namespace

bool needs_error_control(const Body& body) {
    return body.rotor.kind == InertiaKind::kGeneral || !body.torque.isZero(0);
}

bool move_to_tolerance(WorldData& world, IslandWorkspace& work, std::uint32_t index, Real dt) {
    Body& body = world.bodies[index];
    ErrorControl& control = world.control[index];
    const Turned t = turn_to_tolerance(world, body, control, dt, work.report);
    work.report.error_rate = std::max(work.report.error_rate, control.error / dt);
    const Vec3 a = external_acceleration(world, body);
    return accept_state(body, {t.q, body.X_WB.p + dt * body.v + (0.5 * dt * dt) * a}, body.v + dt * a, t.w);
}

void prepare_error_control(WorldData& world) {
    world.control.resize(world.bodies.size());
}

bool is_estimate_due(WorldData& world, int index) {
    ErrorControl& control = control_of(world, index);
    const std::uint64_t signature = signature_of(world, index);
    bool due = --control.steps_left < 0 || control.signature != signature;
    if (control.signature == 0) begin_anew(control);
    control.signature = signature;
    const IndexRange bodies = world.islands.bodies(index);
    for (int k = bodies.begin; k < bodies.end; ++k) {
        ErrorControl& c = world.control[world.islands.body_list()[k]];
        due |= c.disturbed;
        c.disturbed = false;
    }
    return due;
}

bool goes_on_as_before(WorldData& world, IslandWorkspace& work, int index, bool due) {
    ErrorControl& control = control_of(world, index);
    const IndexRange bodies = world.islands.bodies(index);
    Real jump = 0;
    for (int k = bodies.begin; k < bodies.end; ++k) {
        const std::uint32_t body = world.islands.body_list()[k];
        Vec3& before = world.control[body].gain;
        const Vec3 gain = work.solver_bodies.velocity[1 + k - bodies.begin].v - world.bodies[body].v;
        jump = std::max(jump, (gain - before).norm());
        before = gain;
    }
    const bool same = !due && (jump <= world.settings.tolerance || jump <= 2 * control.jump);
    if (!same) control.jump = jump;
    return same;
}

void keep_coarse(IslandWorkspace& work) {
    work.coarse.motion.assign(work.solver_bodies.motion.begin(), work.solver_bodies.motion.end());
    work.coarse.velocity.assign(work.solver_bodies.velocity.begin(), work.solver_bodies.velocity.end());
}

Real error_of_coarse(const IslandWorkspace& work) {
    Real error = 0;
    for (std::size_t i = 1; i < work.coarse.motion.size(); ++i) {
        const BodyMotion &m1 = work.coarse.motion[i], &m2 = work.solver_bodies.motion[i];
        if (m1.inv_mass == 0) continue;
        const BodyVelocity &u1 = work.coarse.velocity[i], &u2 = work.solver_bodies.velocity[i];
        error = std::max(
            error, (m1.x - m2.x).norm() + kLasting * (u1.v - u2.v).norm() + turn_error(m1.q, u1.w, m2.q, u2.w, radius_of(m1), kLasting));
    }
    return error;
}

void take_error_report(const StepReport& part, StepReport& report) {
    report.error_estimates += part.error_estimates;
    report.steps_refined += part.steps_refined;
    report.tolerance_missed += part.tolerance_missed;
    report.error_rate = std::max(report.error_rate, part.error_rate);
}

void take_estimate(ErrorControl& control, Real error, Real admitted) {
    const Real growth = control.gained > 0 ? control.gained : kGrowth;
    const bool is_certain = kRoom * error <= admitted, falls = control.level > 0 && kRoom * growth * error <= admitted;
    control.error = error;
    control.interval = is_certain ? std::min(2 * control.interval, kLongestInterval) : 1;
    control.steps_left = falls ? 0 : control.interval - 1;
    if (falls) {
        --control.level;
        control.error *= growth;
    } else if (!is_certain && control.level + 1 < kFinestLevel) {
        ++control.level;
    }
}

}  // namespace cairn
