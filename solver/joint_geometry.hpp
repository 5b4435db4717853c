// C and G of every joint type (the formulas are in solver/joint_rows.hpp). Inline: a pass over the rows evaluates them for every joint.
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>

namespace cairn {

enum class JointKind : std::uint8_t { kBall, kHinge, kSlider, kFixed, kDistance };

// A joint in its bodies' frames; constant.
struct JointGeometry {
    Vec3 anchor_a_A = Vec3::Zero();
    Vec3 anchor_b_B = Vec3::Zero();
    Mat3 frame_A = Mat3::Identity();  // columns e_k
    Mat3 frame_B = Mat3::Identity();  // columns f_k
    Real length = 0;                  // distance joint: L [m]
};

// The pose of a body as a joint sees it.
struct JointPose {
    Vec3 x;
    Mat3 R;
};

// A body's velocity as a joint sees it.
struct JointVelocity {
    Vec3 v;
    Vec3 w;
};

template <int N>
using VecN = Eigen::Matrix<Real, N, 1>;
template <int N>
using Jacobian = Eigen::Matrix<Real, N, 6>;

constexpr int joint_rows(JointKind kind) {
    constexpr int rows[] = {3, 5, 5, 6, 1};
    return rows[static_cast<int>(kind)];
}

// C of a joint [m and 1].
template <JointKind K>
VecN<joint_rows(K)> joint_error(const JointGeometry& g, const JointPose& a, const JointPose& b);

// G of a joint: the columns for (v_a, w_a) and for (v_b, w_b).
template <JointKind K>
void joint_jacobian(const JointGeometry& g, const JointPose& a, const JointPose& b, Jacobian<joint_rows(K)>& G_a,
                    Jacobian<joint_rows(K)>& G_b);

// The second time derivative of C [m/s² and 1/s²] while both bodies keep their velocities.
template <JointKind K>
VecN<joint_rows(K)> joint_curvature(const JointGeometry& g, const JointPose& a, const JointPose& b, const JointVelocity& u_a,
                                    const JointVelocity& u_b);

// The force [N] on A of the impulses (or forces) λ.
template <JointKind K>
Vec3 joint_force(const JointGeometry& g, const JointPose& a, const JointPose& b, const VecN<joint_rows(K)>& lambda);

namespace joint_geometry {

inline Vec3 separation(const JointGeometry& g, const JointPose& a, const JointPose& b) {
    return a.x + a.R * g.anchor_a_A - b.x - b.R * g.anchor_b_B;
}

// The pairs (j, k) of e_j·f_k that make `ang`, row by row.
inline constexpr int kAngularPair[3][2] = {{1, 2}, {2, 0}, {0, 1}};

inline Vec3 angular_error(const Mat3& E, const Mat3& F) {
    Vec3 c;
    for (int i = 0; i < 3; ++i) c[i] = E.col(kAngularPair[i][0]).dot(F.col(kAngularPair[i][1]));
    return c;
}

// What turning on makes of the anchors' velocities, A's less B's.
inline Vec3 centripetal(const JointGeometry& g, const JointPose& a, const JointPose& b, const Vec3& w_a, const Vec3& w_b) {
    const Vec3 r_a = a.R * g.anchor_a_A, r_b = b.R * g.anchor_b_B;
    return w_a.cross(w_a.cross(r_a)) - w_b.cross(w_b.cross(r_b));
}

// d²/dt² of e·f, e fixed in A and f in B.
inline Real turning(const Vec3& e, const Vec3& f, const Vec3& w_a, const Vec3& w_b) {
    const Vec3 e1 = w_a.cross(e), f1 = w_b.cross(f);
    return w_a.cross(e1).dot(f) + 2 * e1.dot(f1) + e.dot(w_b.cross(f1));
}

inline Vec3 angular_curvature(const Mat3& E, const Mat3& F, const Vec3& w_a, const Vec3& w_b) {
    Vec3 c;
    for (int i = 0; i < 3; ++i) c[i] = turning(E.col(kAngularPair[i][0]), F.col(kAngularPair[i][1]), w_a, w_b);
    return c;
}

inline Vec3 separation_rate(const JointGeometry& g, const JointPose& a, const JointPose& b, const JointVelocity& u_a,
                            const JointVelocity& u_b) {
    return u_a.v + u_a.w.cross(a.R * g.anchor_a_A) - u_b.v - u_b.w.cross(b.R * g.anchor_b_B);
}

// Rows [first, first + 3): d/dt (e_j·f_k) = (w_a − w_b)·(e_j × f_k).
template <int N>
void angular_rows(const Mat3& E, const Mat3& F, int first, Jacobian<N>& G_a, Jacobian<N>& G_b) {
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis = E.col(kAngularPair[i][0]).cross(F.col(kAngularPair[i][1]));
        G_a.row(first + i).template head<3>().setZero();
        G_b.row(first + i).template head<3>().setZero();
        G_a.row(first + i).template tail<3>() = axis.transpose();
        G_b.row(first + i).template tail<3>() = -axis.transpose();
    }
}

// Rows [0, 3) of a ball: ḋ = v_a − r_a × w_a − v_b + r_b × w_b.
template <int N>
void point_rows(const JointGeometry& g, const JointPose& a, const JointPose& b, Jacobian<N>& G_a, Jacobian<N>& G_b) {
    const Vec3 r_a = a.R * g.anchor_a_A, r_b = b.R * g.anchor_b_B;
    G_a.template topLeftCorner<3, 3>() = Mat3::Identity();
    G_b.template topLeftCorner<3, 3>() = -Mat3::Identity();
    G_a.template topRightCorner<3, 3>() = -skew(r_a);
    G_b.template topRightCorner<3, 3>() = skew(r_b);
}

}  // namespace joint_geometry

template <>
inline VecN<3> joint_error<JointKind::kBall>(const JointGeometry& g, const JointPose& a, const JointPose& b) {
    return joint_geometry::separation(g, a, b);
}

template <>
inline void joint_jacobian<JointKind::kBall>(const JointGeometry& g, const JointPose& a, const JointPose& b, Jacobian<3>& G_a,
                                             Jacobian<3>& G_b) {
    joint_geometry::point_rows<3>(g, a, b, G_a, G_b);
}

template <>
inline VecN<5> joint_error<JointKind::kHinge>(const JointGeometry& g, const JointPose& a, const JointPose& b) {
    VecN<5> c;
    const Vec3 axis_b = b.R * g.frame_B.col(0);
    c.head<3>() = joint_geometry::separation(g, a, b);
    c[3] = (a.R * g.frame_A.col(1)).dot(axis_b);
    c[4] = (a.R * g.frame_A.col(2)).dot(axis_b);
    return c;
}

template <>
inline void joint_jacobian<JointKind::kHinge>(const JointGeometry& g, const JointPose& a, const JointPose& b, Jacobian<5>& G_a,
                                              Jacobian<5>& G_b) {
    joint_geometry::point_rows<5>(g, a, b, G_a, G_b);
    const Vec3 axis_b = b.R * g.frame_B.col(0);
    for (int i = 0; i < 2; ++i) {
        const Vec3 axis = (a.R * g.frame_A.col(1 + i)).cross(axis_b);
        G_a.row(3 + i) << 0, 0, 0, axis.transpose();
        G_b.row(3 + i) << 0, 0, 0, -axis.transpose();
    }
}

template <>
inline VecN<5> joint_error<JointKind::kSlider>(const JointGeometry& g, const JointPose& a, const JointPose& b) {
    const Mat3 E = a.R * g.frame_A, F = b.R * g.frame_B;
    const Vec3 d = joint_geometry::separation(g, a, b);
    VecN<5> c;
    c[0] = E.col(1).dot(d);
    c[1] = E.col(2).dot(d);
    c.tail<3>() = joint_geometry::angular_error(E, F);
    return c;
}

template <>
inline void joint_jacobian<JointKind::kSlider>(const JointGeometry& g, const JointPose& a, const JointPose& b, Jacobian<5>& G_a,
                                               Jacobian<5>& G_b) {
    const Mat3 E = a.R * g.frame_A, F = b.R * g.frame_B;
    const Vec3 r_b = b.R * g.anchor_b_B;
    const Vec3 arm_a = b.x + r_b - a.x;  // from A's centre to B's anchor: e turns with A while d is not zero along the axis
    for (int i = 0; i < 2; ++i) {
        const Vec3 e = E.col(1 + i);
        G_a.row(i) << e.transpose(), arm_a.cross(e).transpose();
        G_b.row(i) << -e.transpose(), -r_b.cross(e).transpose();
    }
    joint_geometry::angular_rows<5>(E, F, 2, G_a, G_b);
}

template <>
inline VecN<6> joint_error<JointKind::kFixed>(const JointGeometry& g, const JointPose& a, const JointPose& b) {
    VecN<6> c;
    c.head<3>() = joint_geometry::separation(g, a, b);
    c.tail<3>() = joint_geometry::angular_error(a.R * g.frame_A, b.R * g.frame_B);
    return c;
}

template <>
inline void joint_jacobian<JointKind::kFixed>(const JointGeometry& g, const JointPose& a, const JointPose& b, Jacobian<6>& G_a,
                                              Jacobian<6>& G_b) {
    joint_geometry::point_rows<6>(g, a, b, G_a, G_b);
    joint_geometry::angular_rows<6>(a.R * g.frame_A, b.R * g.frame_B, 3, G_a, G_b);
}

template <>
inline VecN<1> joint_error<JointKind::kDistance>(const JointGeometry& g, const JointPose& a, const JointPose& b) {
    return VecN<1>(joint_geometry::separation(g, a, b).norm() - g.length);
}

template <>
inline void joint_jacobian<JointKind::kDistance>(const JointGeometry& g, const JointPose& a, const JointPose& b, Jacobian<1>& G_a,
                                                 Jacobian<1>& G_b) {
    const Vec3 d = joint_geometry::separation(g, a, b);
    const Real length = d.norm();
    const Vec3 u = length > 0 ? Vec3(d / length) : Vec3::UnitZ();  // a rod shrunk to a point has no direction of its own
    G_a << u.transpose(), (a.R * g.anchor_a_A).cross(u).transpose();
    G_b << -u.transpose(), -(b.R * g.anchor_b_B).cross(u).transpose();
}

template <>
inline VecN<3> joint_curvature<JointKind::kBall>(const JointGeometry& g, const JointPose& a, const JointPose& b, const JointVelocity& u_a,
                                                 const JointVelocity& u_b) {
    return joint_geometry::centripetal(g, a, b, u_a.w, u_b.w);
}

template <>
inline VecN<5> joint_curvature<JointKind::kHinge>(const JointGeometry& g, const JointPose& a, const JointPose& b, const JointVelocity& u_a,
                                                  const JointVelocity& u_b) {
    VecN<5> c;
    const Vec3 axis_b = b.R * g.frame_B.col(0);
    c.head<3>() = joint_geometry::centripetal(g, a, b, u_a.w, u_b.w);
    for (int i = 0; i < 2; ++i) c[3 + i] = joint_geometry::turning(a.R * g.frame_A.col(1 + i), axis_b, u_a.w, u_b.w);
    return c;
}

template <>
inline VecN<5> joint_curvature<JointKind::kSlider>(const JointGeometry& g, const JointPose& a, const JointPose& b, const JointVelocity& u_a,
                                                   const JointVelocity& u_b) {
    const Mat3 E = a.R * g.frame_A, F = b.R * g.frame_B;
    const Vec3 d = joint_geometry::separation(g, a, b), d1 = joint_geometry::separation_rate(g, a, b, u_a, u_b);
    const Vec3 d2 = joint_geometry::centripetal(g, a, b, u_a.w, u_b.w);
    VecN<5> c;
    for (int i = 0; i < 2; ++i) {
        const Vec3 e = E.col(1 + i), e1 = u_a.w.cross(e);
        c[i] = u_a.w.cross(e1).dot(d) + 2 * e1.dot(d1) + e.dot(d2);
    }
    c.tail<3>() = joint_geometry::angular_curvature(E, F, u_a.w, u_b.w);
    return c;
}

template <>
inline VecN<6> joint_curvature<JointKind::kFixed>(const JointGeometry& g, const JointPose& a, const JointPose& b, const JointVelocity& u_a,
                                                  const JointVelocity& u_b) {
    VecN<6> c;
    c.head<3>() = joint_geometry::centripetal(g, a, b, u_a.w, u_b.w);
    c.tail<3>() = joint_geometry::angular_curvature(a.R * g.frame_A, b.R * g.frame_B, u_a.w, u_b.w);
    return c;
}

template <>
inline VecN<1> joint_curvature<JointKind::kDistance>(const JointGeometry& g, const JointPose& a, const JointPose& b,
                                                     const JointVelocity& u_a, const JointVelocity& u_b) {
    const Vec3 d = joint_geometry::separation(g, a, b), d1 = joint_geometry::separation_rate(g, a, b, u_a, u_b);
    const Real length = d.norm();
    if (!(length > 0)) return VecN<1>(0.0);
    const Real rate = d.dot(d1) / length;
    return VecN<1>((d1.squaredNorm() - rate * rate + d.dot(joint_geometry::centripetal(g, a, b, u_a.w, u_b.w))) / length);
}

template <>
inline Vec3 joint_force<JointKind::kBall>(const JointGeometry&, const JointPose&, const JointPose&, const VecN<3>& lambda) {
    return lambda;
}

template <>
inline Vec3 joint_force<JointKind::kHinge>(const JointGeometry&, const JointPose&, const JointPose&, const VecN<5>& lambda) {
    return lambda.head<3>();
}

template <>
inline Vec3 joint_force<JointKind::kSlider>(const JointGeometry& g, const JointPose& a, const JointPose&, const VecN<5>& lambda) {
    return a.R * (g.frame_A.rightCols<2>() * lambda.head<2>());
}

template <>
inline Vec3 joint_force<JointKind::kFixed>(const JointGeometry&, const JointPose&, const JointPose&, const VecN<6>& lambda) {
    return lambda.head<3>();
}

template <>
inline Vec3 joint_force<JointKind::kDistance>(const JointGeometry& g, const JointPose& a, const JointPose& b, const VecN<1>& lambda) {
    const Vec3 d = joint_geometry::separation(g, a, b);
    const Real length = d.norm();
    return lambda[0] * (length > 0 ? Vec3(d / length) : Vec3::UnitZ());
}

}  // namespace cairn
