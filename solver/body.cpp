#include "solver/body.hpp"

namespace cairn {

void kick(SolverBodies& bodies, int begin, int end, Real h) {
    for (int i = begin; i < end; ++i) {
        const BodyMotion& m = bodies.motion[i];
        bodies.velocity[i].v += h * m.acceleration;
        bodies.velocity[i].w += m.inv_inertia_W * (h * m.torque);
    }
}

int drift(SolverBodies& bodies, int begin, int end, Real h) {
    int rotors = 0;
    for (int i = begin; i < end; ++i) {
        BodyMotion& m = bodies.motion[i];
        BodyVelocity& u = bodies.velocity[i];
        m.x += h * u.v;
        const Real turn = h * u.w.norm();
        if (turn == 0) continue;
        // One stage: within a substep the kicks are of 2nd order anyway.
        rotate_free(m.q, u.w, m.rotor, h, 1);
        rotors += m.rotor.kind != InertiaKind::kSpherical;
        m.turned += turn;
        m.R = m.q.toRotationMatrix();
        // A spherical tensor looks the same from everywhere.
        if (m.rotor.kind != InertiaKind::kSpherical) m.inv_inertia_W = m.R * m.inv_inertia_B * m.R.transpose();
    }
    return rotors;
}

void begin_push(SolverBodies& bodies, int begin, int end) {
    for (int i = begin; i < end; ++i) bodies.push[i] = bodies.velocity[i];
}

void measure_push(SolverBodies& bodies, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        BodyVelocity &push = bodies.push[i], &u = bodies.velocity[i];
        push = {u.v - push.v, u.w - push.w};
    }
}

void end_push(SolverBodies& bodies, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        bodies.velocity[i].v -= bodies.push[i].v;
        bodies.velocity[i].w -= bodies.push[i].w;
    }
}

void drift_kinematic(SolverBodies& bodies, int begin, int end, Real h) {
    for (int i = begin; i < end; ++i) {
        BodyMotion& m = bodies.motion[i];
        const BodyVelocity& u = bodies.velocity[i];
        m.x += h * u.v;
        m.q = exp_rotation(h * u.w) * m.q;
        m.q.normalize();
        m.R = m.q.toRotationMatrix();
        m.turned += h * u.w.norm();
    }
}

}  // namespace cairn
