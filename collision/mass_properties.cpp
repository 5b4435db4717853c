#include "collision/mass_properties.hpp"

#include "collision/hull.hpp"
#include "collision/shape.hpp"

#include <Eigen/Eigenvalues>

namespace cairn {
namespace {

constexpr Real kDiagonal = 1e-12;  // off-diagonals below this share of the trace are round-off

Mat3 diagonal(Real x, Real y, Real z) {
    return Vec3(x, y, z).asDiagonal();
}

// What Steiner's theorem adds to the inertia of a mass m whose centroid lies at d.
Mat3 steiner(Real m, const Vec3& d) {
    return m * (d.squaredNorm() * Mat3::Identity() - d * d.transpose());
}

VolumeProperties of_sphere(Real r) {
    const Real v = 4 * kPi / 3 * r * r * r;
    const Real i = 0.4 * v * r * r;
    return {v, Vec3::Zero(), diagonal(i, i, i)};
}

VolumeProperties of_box(const Vec3& h) {
    const Real v = 8 * h.x() * h.y() * h.z();
    const Vec3 s = h.cwiseProduct(h) / 3;
    return {v, Vec3::Zero(), diagonal(v * (s.y() + s.z()), v * (s.z() + s.x()), v * (s.x() + s.y()))};
}

VolumeProperties of_cylinder(Real r, Real h) {
    const Real v = 2 * kPi * r * r * h;
    const Real across = v * (r * r / 4 + h * h / 3);
    return {v, Vec3::Zero(), diagonal(across, across, v * r * r / 2)};
}

// A cylinder and two half balls. A half ball of mass m has (2/5) m r² about the centre of its flat face and its centroid 3r/8 above that,
// so about a point h below the flat face it has m ((2/5) r² + h² + (3/4) r h).
VolumeProperties of_capsule(Real r, Real h) {
    VolumeProperties sum = of_cylinder(r, h);
    const Real v = 4 * kPi / 3 * r * r * r;
    const Real across = v * (0.4 * r * r + h * h + 0.75 * r * h);
    sum.volume += v;
    sum.inertia += diagonal(across, across, 0.4 * v * r * r);
    return sum;
}

VolumeProperties in_own_frame(const Shape& shape) {
    switch (shape.type) {
        case ShapeType::kSphere:
            return of_sphere(shape.radius);
        case ShapeType::kBox:
            return of_box(shape.half_extents);
        case ShapeType::kCapsule:
            return of_capsule(shape.radius, shape.half_height);
        case ShapeType::kCylinder:
            return of_cylinder(shape.radius, shape.half_height);
        case ShapeType::kHull:
            return volume_properties(*shape.hull);
        case ShapeType::kPlane:
        case ShapeType::kMesh:
            break;
    }
    return {};
}

}  // namespace

// Tetrahedra from the mean vertex o to the triangles of a fan over each face. Over a tetrahedron (0, a, b, c) of volume det/6:
//     ∫ x dV = det/24 (a + b + c),   ∫ x xᵀ dV = det/120 (a aᵀ + b bᵀ + c cᵀ + s sᵀ), s = a + b + c   (after Tonon 2004).
VolumeProperties volume_properties(const ConvexHull& hull) {
    Vec3 o = Vec3::Zero();
    for (const Vec3& v : hull.vertices()) o += v;
    o /= static_cast<Real>(hull.vertices().size());

    Real det_sum = 0;
    Vec3 first = Vec3::Zero();
    Mat3 second = Mat3::Zero();
    for (const ConvexHull::Face& face : hull.faces()) {
        const int* loop = &hull.loop()[face.first];
        const Vec3 a = hull.vertices()[loop[0]] - o;
        for (int k = 1; k + 1 < face.count; ++k) {
            const Vec3 b = hull.vertices()[loop[k]] - o;
            const Vec3 c = hull.vertices()[loop[k + 1]] - o;
            const Vec3 s = a + b + c;
            const Real det = a.dot(b.cross(c));
            det_sum += det;
            first += det * s;
            second += det * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
        }
    }

    const Real volume = det_sum / 6;
    const Vec3 d = first / 24 / volume;
    const Mat3 about_o = second / 120;
    const Mat3 covariance = about_o - volume * d * d.transpose();
    return {volume, o + d, covariance.trace() * Mat3::Identity() - covariance};
}

VolumeProperties volume_properties(const Shape& shape) {
    VolumeProperties p = in_own_frame(shape);
    const Transform X_BS(shape.X_BS);
    p.centroid = X_BS * p.centroid;
    p.inertia = X_BS.R * p.inertia * X_BS.R.transpose();
    p.inertia = (0.5 * (p.inertia + p.inertia.transpose())).eval();
    return p;
}

VolumeProperties volume_properties(const std::vector<Shape>& shapes) {
    if (shapes.size() == 1) return volume_properties(shapes[0]);

    std::vector<VolumeProperties> parts;
    VolumeProperties sum;
    for (const Shape& shape : shapes) {
        parts.push_back(volume_properties(shape));
        sum.volume += parts.back().volume;
        sum.centroid += parts.back().volume * parts.back().centroid;
    }
    if (!(sum.volume > 0)) return {};
    sum.centroid /= sum.volume;
    for (const VolumeProperties& part : parts) sum.inertia += part.inertia + steiner(part.volume, part.centroid - sum.centroid);
    return sum;
}

PrincipalInertia principal_inertia(const Mat3& inertia_B) {
    const Mat3 symmetric = 0.5 * (inertia_B + inertia_B.transpose());
    const Vec3 off(symmetric(0, 1), symmetric(1, 2), symmetric(0, 2));
    // An already diagonal tensor keeps its order and its frame: principal moments that were given stay as they were given.
    if (off.cwiseAbs().maxCoeff() <= kDiagonal * symmetric.trace()) return {symmetric.diagonal(), Quat::Identity()};

    const Eigen::SelfAdjointEigenSolver<Mat3> solver(symmetric);
    Mat3 R = solver.eigenvectors();
    if (R.determinant() < 0) R.col(2) = -R.col(2);
    return {solver.eigenvalues(), Quat(R).normalized()};
}

}  // namespace cairn
