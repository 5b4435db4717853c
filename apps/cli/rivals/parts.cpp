#include "apps/cli/rivals/parts.hpp"

#include "collision/mass_properties.hpp"

#include <cmath>

namespace cairn::cli {

Mat3 inertia_of(const BodyDef& body) {
    if (body.inertia) return body.inertia->asDiagonal();
    const VolumeProperties volume = volume_properties(body.shapes);
    if (!(volume.volume > 0)) return Mat3::Zero();
    return body.mass / volume.volume * volume.inertia;
}

Pose driven_pose(const BodyDef& body, Real t) {
    const Quat q0 = body.rotation.normalized();
    if (!body.motion) return {exp_rotation(t * body.angular_velocity) * q0, body.position + t * body.linear_velocity};
    const RotateSine& m = *body.motion;
    const Vec3 turn = m.amplitude * std::sin(2 * kPi * t / m.period + m.phase) * m.axis.normalized();
    return {exp_rotation(turn) * q0, body.position};
}

std::pair<Vec3, Vec3> velocity_between(const Pose& from, const Pose& to, Real h) {
    const Eigen::AngleAxis<Real> turn(Quat(to.q * from.q.conjugate()));
    const Real angle = turn.angle() > kPi ? turn.angle() - 2 * kPi : turn.angle();
    const Vec3 rate = angle / h * turn.axis();
    return {Vec3((to.p - from.p) / h), rate};
}

Quat triad(const Vec3& x, const Vec3& y) {
    Mat3 R;
    R.col(0) = x;
    R.col(1) = y;
    R.col(2) = x.cross(y);
    return Quat(R);
}

void refuse_what_no_adapter_has(const Scene& scene) {
    for (const BodyDef& body : scene.bodies) {
        if (body.rolling_friction != 0) throw Unsupported("rolling_friction");
        if (body.torsional_friction != 0) throw Unsupported("torsional_friction");
    }
}

}  // namespace cairn::cli
