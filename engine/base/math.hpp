// Scalars, vectors, rotations and poses shared by every room. SI units, double precision, right-handed.
//
// Vectors are Eigen's; quaternions carry Eigen::DontAlign so that a consumer's -march flags (which change Eigen's alignment) cannot change
// the layout of a Cairn type.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>

namespace cairn {

using Real = double;
using Vec3 = Eigen::Matrix<Real, 3, 1>;
using Mat3 = Eigen::Matrix<Real, 3, 3>;
using Quat = Eigen::Quaternion<Real, Eigen::DontAlign>;

constexpr Real kPi = 3.14159265358979323846;

// Cross-product matrix: skew(a) b = a × b.
inline Mat3 skew(const Vec3& a) {
    Mat3 m;
    m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return m;
}

// Some unit vector perpendicular to the unit vector n; a continuous function of n almost everywhere, bitwise deterministic.
inline Vec3 any_perpendicular(const Vec3& n) {
    const Vec3 e = std::abs(n.x()) < 0.57735 ? Vec3::UnitX() : Vec3::UnitY();
    return n.cross(e).normalized();
}

// v / ‖v‖, or `otherwise` where v is too short to have a direction.
inline Vec3 direction_or(const Vec3& v, const Vec3& otherwise) {
    const Real length = v.norm();
    return length > 1e-150 ? Vec3(v / length) : otherwise;
}

// Rotation by the vector φ [rad]: axis φ/‖φ‖, angle ‖φ‖ (the exponential map of SO(3)).
inline Quat exp_rotation(const Vec3& phi) {
    const Real angle2 = phi.squaredNorm();
    Real c, s;            // cos(‖φ‖/2) and sin(‖φ‖/2)/‖φ‖
    if (angle2 < 1e-4) {  // series to the 6th order: error below 1e-17
        c = 1 - angle2 / 8 * (1 - angle2 / 48 * (1 - angle2 / 120));
        s = 0.5 - angle2 / 48 * (1 - angle2 / 80 * (1 - angle2 / 168));
    } else {
        const Real angle = std::sqrt(angle2);
        c = std::cos(angle / 2);
        s = std::sin(angle / 2) / angle;
    }
    return Quat(c, s * phi.x(), s * phi.y(), s * phi.z());
}

// A rigid transform with the rotation as a quaternion: x_W = q x_B + p. What a body's state holds.
struct Pose {
    Quat q = Quat::Identity();
    Vec3 p = Vec3::Zero();
};

// A rigid transform with the rotation as a matrix: x_W = R x_B + p. What collision and solver kernels use.
struct Transform {
    Mat3 R = Mat3::Identity();
    Vec3 p = Vec3::Zero();

    Transform() = default;
    Transform(const Mat3& rotation, const Vec3& position) : R(rotation), p(position) {}
    explicit Transform(const Pose& pose) : R(pose.q.toRotationMatrix()), p(pose.p) {}

    Vec3 operator*(const Vec3& x) const { return R * x + p; }
    Transform operator*(const Transform& X) const { return {R * X.R, R * X.p + p}; }
    // The point x_W in this frame: Rᵀ (x_W − p).
    Vec3 to_local(const Vec3& x_W) const { return R.transpose() * (x_W - p); }
};

// The pose of C in A from those of B in A and of C in B.
inline Pose operator*(const Pose& X_AB, const Pose& X_BC) {
    return {X_AB.q * X_BC.q, X_AB.q * X_BC.p + X_AB.p};
}

inline bool is_finite(const Vec3& v) {
    return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}
inline bool is_finite(const Quat& q) {
    return std::isfinite(q.w()) && std::isfinite(q.x()) && std::isfinite(q.y()) && std::isfinite(q.z());
}

// Whether something of this norm can be divided by it (its square neither overflowed nor vanished).
inline bool is_normalisable(Real norm) {
    return std::isfinite(norm) && norm > 1e-6;
}

}  // namespace cairn
