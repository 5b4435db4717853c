#include "engine/base/math.hpp"

#include "tests/support/catch.hpp"

#include <limits>
#include <random>

using namespace cairn;

namespace {

Vec3 random_vector(std::mt19937& random) {
    std::uniform_real_distribution<Real> uniform(-1, 1);
    const Real x = uniform(random), y = uniform(random), z = uniform(random);
    return Vec3(x, y, z);
}

Pose random_pose(std::mt19937& random) {
    return {exp_rotation(3 * random_vector(random)), random_vector(random)};
}

constexpr Real kRounding = 4e-15;  // a dozen roundings of numbers of size about one

}  // namespace

TEST_CASE("skew(a) b is the cross product") {
    std::mt19937 random(1);
    for (int i = 0; i < 20; ++i) {
        const Vec3 a = random_vector(random), b = random_vector(random);
        CHECK((skew(a) * b - a.cross(b)).norm() < kRounding);
        CHECK(skew(a) == -skew(a).transpose());
    }
}

TEST_CASE("the perpendicular of a unit vector is unit and perpendicular, along the axes too") {
    std::mt19937 random(2);
    std::vector<Vec3> normals = {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitZ()};
    for (int i = 0; i < 1000; ++i) normals.push_back(random_vector(random).normalized());
    for (const Vec3& n : normals) {
        const Vec3 t = any_perpendicular(n);
        CHECK(std::abs(t.norm() - 1) < kRounding);
        CHECK(std::abs(t.dot(n)) < kRounding);
    }
}

// Angles on both sides of the switch to the series, at ‖φ‖ = 0.01.
TEST_CASE("the rotation by a vector is the one about its axis by its length") {
    std::mt19937 random(3);
    const Real angle = GENERATE(0.0, 1e-300, 1e-8, 1e-3, 0.00999999, 0.01, 0.01000001, 0.5, 3.0, kPi, 6.0, 100.0);
    CAPTURE(angle);
    for (int i = 0; i < 10; ++i) {
        const Vec3 axis = random_vector(random).normalized();
        const Quat q = exp_rotation(angle * axis);
        const Quat expected(Eigen::AngleAxis<Real>(angle, axis));
        // ‖φ‖ is rounded to 1.1e-16 of itself, which an angle of 100 turns into 1.4e-14.
        const Real rounding = kRounding + 4e-16 * angle;
        CHECK((q.coeffs() - expected.coeffs()).norm() < rounding);
        CHECK(std::abs(q.norm() - 1) < kRounding);
        // Relative accuracy of small rotations too: the vector part is φ/2.
        if (angle > 0 && angle < 1e-3) CHECK((q.vec() - 0.5 * angle * axis).norm() < 1e-6 * angle * angle + kRounding * angle);
    }
}

TEST_CASE("poses and transforms compose alike, and to_local undoes") {
    std::mt19937 random(4);
    for (int i = 0; i < 20; ++i) {
        const Pose A = random_pose(random), B = random_pose(random);
        const Vec3 x = random_vector(random);
        const Transform TA(A), TB(B), TAB(A * B);
        const Vec3 expected = A.q * (B.q * x + B.p) + A.p;
        CHECK((TAB * x - expected).norm() < kRounding);
        CHECK(((TA * TB) * x - expected).norm() < kRounding);
        CHECK((TAB.to_local(expected) - x).norm() < kRounding);
    }
}

TEST_CASE("a vector or rotation with one number that is not finite is not finite") {
    const Real inf = std::numeric_limits<Real>::infinity(), nan = std::nan("");
    CHECK(is_finite(Vec3(1, 2, 3)));
    CHECK(is_finite(Quat::Identity()));
    for (int k = 0; k < 4; ++k)
        for (const Real bad : {inf, -inf, nan}) {
            Vec3 v = Vec3::Ones();
            Quat q(1, 1, 1, 1);
            v[k % 3] = bad;
            q.coeffs()[k] = bad;
            CHECK_FALSE(is_finite(v));
            CHECK_FALSE(is_finite(q));
        }
}
