#include "collision/mass_properties.hpp"

#include "collision/hull.hpp"
#include "collision/shape.hpp"
#include "tests/support/catch.hpp"

#include <functional>
#include <random>

using namespace cairn;

namespace {

Quat random_rotation(std::mt19937& random) {
    std::normal_distribution<Real> normal;
    const Real w = normal(random), x = normal(random), y = normal(random), z = normal(random);
    return Quat(w, x, y, z).normalized();
}

std::vector<Vec3> box_corners(const Vec3& h) {
    std::vector<Vec3> points;
    for (int corner = 0; corner < 8; ++corner)
        points.push_back(h.cwiseProduct(Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
    return points;
}

// Largest difference relative to the largest entry.
Real difference(const Mat3& a, const Mat3& b) {
    return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

// Sums of a few dozen terms, each rounded to 1.1e-16, some of them cancelling by a factor of a few.
constexpr Real kRounding = 1e-14;

// ∫ f over [a, b] by Boole's rule, exact for polynomials up to degree 5.
Real integral(const std::function<Real(Real)>& f, Real a, Real b) {
    const Real s = (b - a) / 4;
    return s * 2 / 45 * (7 * f(a) + 32 * f(a + s) + 12 * f(a + 2 * s) + 32 * f(a + 3 * s) + 7 * f(b));
}

// A body of revolution about z, its radius² given as a function that is quadratic on each of the pieces: slices are discs.
VolumeProperties of_revolution(const std::function<Real(Real)>& radius2, const std::vector<Real>& pieces) {
    VolumeProperties p;
    for (std::size_t i = 0; i + 1 < pieces.size(); ++i) {
        const auto over = [&](const std::function<Real(Real)>& f) { return integral(f, pieces[i], pieces[i + 1]); };
        p.volume += over([&](Real z) { return kPi * radius2(z); });
        const Real axial = over([&](Real z) { return kPi / 2 * radius2(z) * radius2(z); });
        const Real across = axial / 2 + over([&](Real z) { return kPi * radius2(z) * z * z; });
        p.inertia += Mat3(Vec3(across, across, axial).asDiagonal());
    }
    return p;
}

void check_same(const VolumeProperties& a, const VolumeProperties& b, Real tolerance) {
    CHECK(a.volume == Approx(b.volume).epsilon(tolerance));
    CHECK((a.centroid - b.centroid).norm() < tolerance * std::cbrt(b.volume));
    CHECK(difference(a.inertia, b.inertia) < tolerance);
}

}  // namespace

TEST_CASE("sphere, cylinder and capsule have the volume and inertia of their slices summed up") {
    const Real r = GENERATE(0.1, 0.7, 3.0), h = GENERATE(0.05, 1.3);
    CAPTURE(r, h);
    const auto cap = [&](Real z) {
        const Real over = std::max(0.0, std::abs(z) - h);
        return r * r - over * over;
    };
    check_same(volume_properties(Shape::sphere(r)), of_revolution([&](Real z) { return r * r - z * z; }, {-r, r}), kRounding);
    check_same(volume_properties(Shape::cylinder(r, h)), of_revolution([&](Real) { return r * r; }, {-h, h}), kRounding);
    check_same(volume_properties(Shape::capsule(r, h)), of_revolution(cap, {-h - r, -h, h, h + r}), kRounding);
}

TEST_CASE("a capsule without a straight part is a ball, and a thin one is a rod") {
    check_same(volume_properties(Shape::capsule(1, 1e-15)), volume_properties(Shape::sphere(1)), kRounding);
    // Rod of length 2h: I/m = h²/3 across; the caps add terms of order r/h.
    const VolumeProperties thin = volume_properties(Shape::capsule(1e-9, 1));
    CHECK(thin.inertia(0, 0) / thin.volume == Approx(1.0 / 3).epsilon(1e-8));
}

TEST_CASE("a box made as a hull weighs what the box weighs, at any scale") {
    const Real scale = GENERATE(1e-3, 1.0, 1e3);
    CAPTURE(scale);
    const Vec3 h = scale * Vec3(0.3, 1.1, 2);
    const VolumeProperties box = volume_properties(Shape::box(h));
    CHECK(box.volume == Approx(8 * h.prod()).epsilon(1e-15));
    check_same(volume_properties(Shape::convex(box_corners(h))), box, kRounding);

    // Shifted far away the corners lose digits: 10 extents, 10 times the rounding.
    std::vector<Vec3> shifted = box_corners(h);
    for (Vec3& p : shifted) p += scale * Vec3(10, -20, 5);
    VolumeProperties far = box;
    far.centroid = scale * Vec3(10, -20, 5);
    check_same(volume_properties(Shape::convex(shifted)), far, 20 * kRounding);
}

// ∫x = 1/24, ∫x² = 1/60, ∫xy = 1/120 over the tetrahedron x, y, z >= 0, x + y + z <= 1; about the centroid x² gives 1/160, xy gives −1/480.
TEST_CASE("the corner tetrahedron has volume 1/6, centroid 1/4, moments 1/80 and products of inertia 1/480") {
    const VolumeProperties p = volume_properties(Shape::convex({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}));
    CHECK(p.volume == Approx(1.0 / 6).epsilon(kRounding));
    CHECK((p.centroid - Vec3::Constant(0.25)).norm() < kRounding);
    Mat3 expected = Mat3::Constant(1.0 / 480);
    expected.diagonal().setConstant(1.0 / 80);
    CHECK(difference(p.inertia, expected) < kRounding);
}

// Base [−1, 1]², apex at height 1: slices of half side 1 − z. V = 4/3, centroid at 1/4; ∫x² = 4/15; ∫z² = 2/15 − V/16 = 1/20 about the
// centroid. Unlike in a box, the mean of the vertices (at 1/5) is not the centroid.
TEST_CASE("a square pyramid has its centroid at a quarter of its height and moments 19/60, 19/60, 8/15") {
    const VolumeProperties p =
        volume_properties(Shape::convex({Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(1, 1, 0), Vec3(-1, 1, 0), Vec3(0, 0, 1)}));
    CHECK(p.volume == Approx(4.0 / 3).epsilon(kRounding));
    CHECK((p.centroid - Vec3(0, 0, 0.25)).norm() < kRounding);
    CHECK(difference(p.inertia, Vec3(19.0 / 60, 19.0 / 60, 8.0 / 15).asDiagonal()) < kRounding);
}

TEST_CASE("turning and moving a shape turns its inertia and moves its centroid") {
    std::mt19937 random(4);
    for (int i = 0; i < 20; ++i) {
        const Pose X{random_rotation(random), Vec3(1, -2, 3)};
        const Mat3 R = X.q.toRotationMatrix();
        const Vec3 h(0.3, 1.1, 2);
        const VolumeProperties still = volume_properties(Shape::box(h)), moved = volume_properties(Shape::box(h, X));
        CHECK(moved.volume == still.volume);
        CHECK(moved.centroid == X.p);
        CHECK(difference(moved.inertia, R * still.inertia * R.transpose()) < kRounding);
        CHECK(moved.inertia == moved.inertia.transpose());

        std::vector<Vec3> turned = box_corners(h);
        for (Vec3& p : turned) p = X.q * p + X.p;
        check_same(volume_properties(Shape::convex(turned)), moved, 10 * kRounding);
    }
}

TEST_CASE("a box cut in pieces weighs what the whole weighs") {
    // Cut at x = −0.2 and the larger piece at z = 0.5; the whole has half extents (1, 0.4, 1.5).
    const std::vector<Shape> pieces = {
        Shape::box(Vec3(0.4, 0.4, 1.5), {Quat::Identity(), Vec3(-0.6, 0, 0)}),
        Shape::box(Vec3(0.6, 0.4, 1.0), {Quat::Identity(), Vec3(0.4, 0, -0.5)}),
        Shape::box(Vec3(0.6, 0.4, 0.5), {Quat::Identity(), Vec3(0.4, 0, 1.0)}),
    };
    check_same(volume_properties(pieces), volume_properties(Shape::box(Vec3(1, 0.4, 1.5))), kRounding);
}

TEST_CASE("a dumb-bell obeys Steiner's theorem") {
    const Real r = 0.2, d = 1.5;
    const VolumeProperties ball = volume_properties(Shape::sphere(r));
    const VolumeProperties p = volume_properties(
        {Shape::sphere(r, {Quat::Identity(), Vec3(2 + d, 1, 0)}), Shape::sphere(r, {Quat::Identity(), Vec3(2 - d, 1, 0)})});
    CHECK(p.volume == Approx(2 * ball.volume).epsilon(kRounding));
    CHECK((p.centroid - Vec3(2, 1, 0)).norm() < kRounding);
    const Real across = 2 * (ball.inertia(0, 0) + ball.volume * d * d);
    CHECK(difference(p.inertia, Vec3(2 * ball.inertia(0, 0), across, across).asDiagonal()) < kRounding);
}

TEST_CASE("planes, meshes and nothing at all have no mass") {
    const Shape mesh = Shape::triangle_mesh({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}});
    for (const std::vector<Shape>& shapes : {std::vector<Shape>{}, {mesh}, {mesh, Shape::plane(Vec3::UnitZ(), 1)}}) {
        const VolumeProperties p = volume_properties(shapes);
        CHECK(p.volume == 0);
        CHECK(p.centroid == Vec3::Zero());
        CHECK(p.inertia == Mat3::Zero());
    }
}

TEST_CASE("a diagonal inertia keeps its moments, their order and the body frame") {
    const Vec3 moments(3, 1, 2);
    Mat3 inertia = moments.asDiagonal();
    inertia(0, 1) = inertia(1, 0) = 1e-13;
    const PrincipalInertia p = principal_inertia(inertia);
    CHECK(p.moments == moments);
    CHECK(p.R_BP.coeffs() == Quat::Identity().coeffs());
}

TEST_CASE("principal moments and axes put together give the tensor back, by a proper rotation") {
    std::mt19937 random(9);
    std::uniform_real_distribution<Real> uniform(0.5, 5);
    for (int i = 0; i < 50; ++i) {
        const Real scale = std::pow(10.0, i % 7 - 3);
        const Real x = uniform(random), y = i % 3 ? uniform(random) : x, z = uniform(random);
        const Mat3 R = random_rotation(random).toRotationMatrix();
        const Mat3 inertia = scale * R * Vec3(x, y, z).asDiagonal() * R.transpose();
        const PrincipalInertia p = principal_inertia(inertia);
        const Mat3 Q = p.R_BP.toRotationMatrix();
        CHECK(Q.determinant() == Approx(1).epsilon(kRounding));
        CHECK(difference(Q * p.moments.asDiagonal() * Q.transpose(), inertia) < kRounding);
    }
}
