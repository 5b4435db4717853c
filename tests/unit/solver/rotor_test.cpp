#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

using namespace cairn;
using namespace cairn::solver_test;

namespace {

struct Spin {
    Quat q;
    Vec3 w;
};

Spin advanced(Spin s, const RotorInertia& inertia, Real time, int steps, int stages) {
    for (int k = 0; k < steps; ++k) rotate_free(s.q, s.w, inertia, time / steps, stages);
    return s;
}

// L_W and ½ wᵀ I w, from the principal moments.
Vec3 momentum(const Spin& s, const RotorInertia& inertia) {
    const Mat3 P = (s.q * inertia.R_BP).toRotationMatrix();
    return P * inertia.moments.asDiagonal() * P.transpose() * s.w;
}
Real energy(const Spin& s, const RotorInertia& inertia) {
    return 0.5 * s.w.dot(momentum(s, inertia));
}

// Angle between two rotations, near enough when it is small: 2 ‖vec(q₁⁻¹ q₂)‖.
Real angle_between(const Quat& q1, const Quat& q2) {
    return 2 * (q1.conjugate() * q2).vec().norm();
}
Real difference(const Spin& s1, const Spin& s2) {
    return angle_between(s1.q, s2.q) + (s1.w - s2.w).norm();
}

RotorInertia random_inertia(Random& random) {
    const Vec3 moments = random_moments(random, 1);
    return make_rotor_inertia(moments, random_rotation(random));
}

Spin random_spin(Random& random, Real rate) {
    const Quat q = random_rotation(random);
    return {q, rate * random_direction(random)};
}

// Two equal moments, the other (axis k) smaller or larger.
RotorInertia symmetric_inertia(Random& random, int k) {
    Vec3 moments = Vec3::Constant(uniform(random, 0.5, 1));
    moments[k] *= uniform(random, 0, 1) < 0.5 ? uniform(random, 0.2, 0.8) : uniform(random, 1.2, 1.9);
    return make_rotor_inertia(moments, random_rotation(random));
}

}  // namespace

TEST_CASE("moments are sorted into spherical, symmetric about the odd axis, and general") {
    const Quat R_BP = exp_rotation(Vec3(0.1, 0.2, 0.3));
    CHECK(make_rotor_inertia(Vec3(2, 2, 2), R_BP).kind == InertiaKind::kSpherical);
    CHECK(make_rotor_inertia(Vec3(2, 3, 4), R_BP).kind == InertiaKind::kGeneral);
    for (int k = 0; k < 3; ++k) {
        for (const Real odd : {1.0, 3.0}) {
            Vec3 moments = Vec3::Constant(2);
            moments[k] = odd;
            const RotorInertia r = make_rotor_inertia(moments, R_BP);
            CHECK(r.kind == InertiaKind::kSymmetric);
            CHECK(r.symmetry_axis == k);
            CHECK(r.moments == moments);
            CHECK(r.R_BP.coeffs() == R_BP.coeffs());
        }
        // Rounding of the moments does not change the kind, a difference of 1e-11 does.
        Vec3 nearly = Vec3::Constant(2);
        nearly[k] *= 1 + 0.5e-12;
        CHECK(make_rotor_inertia(nearly, R_BP).kind == InertiaKind::kSpherical);
        nearly[k] = 2 * (1 + 1e-11);
        CHECK(make_rotor_inertia(nearly, R_BP).kind == InertiaKind::kSymmetric);
        nearly[(k + 1) % 3] = 2 * (1 - 1e-11);
        CHECK(make_rotor_inertia(nearly, R_BP).kind == InertiaKind::kGeneral);
    }
}

TEST_CASE("a spherical body turns about its angular velocity, which stays as it is to the last bit") {
    Random random(1);
    const RotorInertia inertia = make_rotor_inertia(Vec3(2, 2, 2), random_rotation(random));
    for (int i = 0; i < 1000; ++i) {
        const Spin start = random_spin(random, uniform(random, 0, 10));
        const Real h = uniform(random, -1, 1);
        const Spin end = advanced(start, inertia, h, 1, 1);
        const Quat expected = Quat(Eigen::AngleAxis<Real>(h * start.w.norm(), start.w.normalized())) * start.q;
        // The angle, up to 10, is rounded to 1.1e-16 of itself a few times.
        CHECK(angle_between(end.q, expected) < 1e-14);
        CHECK(end.w == start.w);
    }
}

// The axis and the angular velocity of a symmetric body precess about L_W at ‖L_W‖ / I⊥; its spin ω·e is constant.
TEST_CASE("a symmetric body's axis and angular velocity precess about its angular momentum as in closed form") {
    const int k = GENERATE(0, 1, 2);
    CAPTURE(k);
    Random random(2 + k);
    for (int i = 0; i < 300; ++i) {
        const RotorInertia inertia = symmetric_inertia(random, k);
        REQUIRE(inertia.kind == InertiaKind::kSymmetric);
        const Spin start = random_spin(random, uniform(random, 0.1, 10));
        const Real h = uniform(random, -1, 1);
        const Spin end = advanced(start, inertia, h, 1, 1);
        const Vec3 L = momentum(start, inertia);
        const Mat3 precession = Eigen::AngleAxis<Real>(h * L.norm() / inertia.moments[(k + 1) % 3], L.normalized()).toRotationMatrix();
        const Vec3 axis_B = inertia.R_BP * Vec3::Unit(k);
        // Angles up to 20 rad and w up to 10 rad/s, rounded a dozen times.
        CHECK((end.q * axis_B - precession * (start.q * axis_B)).norm() < 4e-14);
        CHECK((end.w - precession * start.w).norm() < 4e-13);
        CHECK((momentum(end, inertia) - L).norm() < 1e-14 * L.norm());
        CHECK(std::abs(energy(end, inertia) / energy(start, inertia) - 1) < 1e-14);
    }
}

// What precession alone does not tell: the spin about the axis. A thousand 4th-order steps over 1 rad err by (1e-3)⁴ and rounding.
TEST_CASE("the closed form of a symmetric body is the motion that the splitting converges to") {
    const int k = GENERATE(0, 1, 2);
    CAPTURE(k);
    Random random(12 + k);
    for (int i = 0; i < 5; ++i) {
        const RotorInertia inertia = symmetric_inertia(random, k);
        RotorInertia general = inertia;
        general.kind = InertiaKind::kGeneral;
        const Spin start = random_spin(random, 1);
        CHECK(difference(advanced(start, inertia, 1, 1, 1), advanced(start, general, 1, 1000, 5)) < 1e-11);
    }
}

TEST_CASE("a general body keeps its angular momentum to rounding, in small steps and in large ones") {
    const int stages = GENERATE(1, 5);
    CAPTURE(stages);
    Random random(3);
    Real worst = 0;
    for (int i = 0; i < 100; ++i) {
        const RotorInertia inertia = random_inertia(random);
        const Real h = i % 2 == 0 ? 1e-3 : 0.5;
        Spin s = random_spin(random, uniform(random, 0.1, 5));
        const Vec3 L = momentum(s, inertia);
        for (int step = 0; step < 100; ++step) {
            rotate_free(s.q, s.w, inertia, h, stages);
            worst = std::max(worst, (momentum(s, inertia) - L).norm() / L.norm());
        }
    }
    // A step rounds L up to 50 times at random (100 steps: √5000 · 1e-16 = 1e-14), and always alike where the principal frame's quaternion
    // is off unit length by an ulp (1e-15 a step).
    CHECK(worst < 3e-13);
}

TEST_CASE("a general body's energy error falls with the square of the step, with its fourth power for five stages") {
    const int stages = GENERATE(1, 5);
    const int order = stages == 1 ? 2 : 4;
    CAPTURE(stages);
    Random random(4);
    for (int i = 0; i < 5; ++i) {
        const RotorInertia inertia = random_inertia(random);
        const Spin start = random_spin(random, 1);
        // Largest error on the way to t = 4 s.
        const auto error = [&](int steps) {
            Spin s = start;
            Real worst = 0;
            for (int k = 0; k < steps; ++k) {
                rotate_free(s.q, s.w, inertia, 4.0 / steps, stages);
                worst = std::max(worst, std::abs(energy(s, inertia) / energy(start, inertia) - 1));
            }
            return worst;
        };
        const Real coarse = error(40), fine = error(80), measured_order = std::log2(coarse / fine);
        CAPTURE(coarse, fine, measured_order);
        CHECK(coarse < (stages == 1 ? 1e-2 : 1e-4));
        // Terms two orders higher are (0.1 rad)² of the leading one, up to a factor of ten; maxima over samples miss a little more.
        CHECK(std::abs(measured_order - order) < 0.2);
    }
}

TEST_CASE("a general body's motion converges with the square of the step, with its fourth power for five stages") {
    const int stages = GENERATE(1, 5);
    const int order = stages == 1 ? 2 : 4;
    CAPTURE(stages);
    Random random(5);
    for (int i = 0; i < 5; ++i) {
        const RotorInertia inertia = random_inertia(random);
        const Spin start = random_spin(random, 1);
        // Errs by (40 / 2000)⁴ = 2e-7 of what the coarsest run of the same order does.
        const Spin reference = advanced(start, inertia, 4, 2000, 5);
        const Real coarse = difference(advanced(start, inertia, 4, 40, stages), reference);
        const Real fine = difference(advanced(start, inertia, 4, 80, stages), reference);
        const Real measured_order = std::log2(coarse / fine);
        CAPTURE(coarse, fine, measured_order);
        CHECK(std::abs(measured_order - order) < 0.1);
    }
}

// Steady rotation about each principal axis has a closed form too, and is where the quaternion turns by a series below 0.01 rad and by
// the sine and cosine above.
TEST_CASE("rotation about a principal axis is exact at angles on both sides of the switch to the series") {
    const int k = GENERATE(0, 1, 2);
    const Real angle = GENERATE(1e-12, 1e-5, 9.99e-3, 0.01, 0.0100001, 0.0199, 0.02, 0.0200001, 0.5, 3.0);
    CAPTURE(k, angle);
    Random random(6);
    const RotorInertia inertia = random_inertia(random);
    for (const Real sign : {1.0, -1.0}) {
        for (const int stages : {1, 5}) {
            const Quat q = random_rotation(random);
            const Vec3 axis = q * (inertia.R_BP * Vec3::Unit(k));
            const Spin end = advanced({q, axis}, inertia, sign * angle, 1, stages);
            const Quat turn = end.q * q.conjugate();
            // A few roundings of unit quaternions per turn, five turns or twenty-five.
            CHECK((turn.vec() - std::sin(sign * angle / 2) * axis).norm() < 4e-15);
            CHECK((end.w - axis).norm() < 1e-14);
        }
    }
}

TEST_CASE("going back in time undoes a step") {
    const int stages = GENERATE(1, 5);
    Random random(7);
    for (int i = 0; i < 100; ++i) {
        const RotorInertia inertia = random_inertia(random);
        const Spin start = random_spin(random, 3);
        Spin s = start;
        rotate_free(s.q, s.w, inertia, 0.1, stages);
        rotate_free(s.q, s.w, inertia, -0.1, stages);
        CHECK(difference(s, start) < 4e-14);  // 100 roundings of w = 3 rad/s at random
    }
}

// The order of the axes decides which splitting is used: a cyclic change of their names is another method of the same order.
TEST_CASE("renaming the principal axes does not change the motion beyond the method's error") {
    Random random(8);
    for (int i = 0; i < 5; ++i) {
        const RotorInertia inertia = random_inertia(random);
        Mat3 cycle;  // takes axis k of the renamed frame to axis k + 1 of the frame
        cycle << 0, 0, 1, 1, 0, 0, 0, 1, 0;
        const Vec3 renamed_moments(inertia.moments[1], inertia.moments[2], inertia.moments[0]);
        const RotorInertia renamed = make_rotor_inertia(renamed_moments, inertia.R_BP * Quat(cycle));
        const Spin start = random_spin(random, 1);
        REQUIRE((momentum(start, renamed) - momentum(start, inertia)).norm() < 1e-14);
        const Spin s1 = advanced(start, inertia, 1, 1000, 5), s2 = advanced(start, renamed, 1, 1000, 5);
        CHECK(difference(s1, s2) < 1e-11);  // (1e-3)⁴ times a constant, 1000 roundings of 1e-15
        // In one large step the two methods differ: the test above would see a wrong axis.
        CHECK(difference(advanced(start, inertia, 1, 1, 1), advanced(start, renamed, 1, 1, 1)) > 1e-6);
    }
}

TEST_CASE("the choice of the body frame does not change the motion") {
    Random random(9);
    for (int i = 0; i < 300; ++i) {
        const int kind = i % 3;
        const RotorInertia inertia = kind == 0 ? random_inertia(random) : symmetric_inertia(random, i % 2);
        RotorInertia principal = inertia;
        principal.R_BP = Quat::Identity();
        const Spin start = random_spin(random, 3);
        const Spin in_body = advanced(start, inertia, 1, 10, 5);
        const Spin in_principal = advanced({start.q * inertia.R_BP, start.w}, principal, 1, 10, 5);
        // Ten steps of fifty roundings, all of the same motion.
        CHECK(angle_between(in_body.q * inertia.R_BP, in_principal.q) < 1e-13);
        CHECK((in_body.w - in_principal.w).norm() < 3e-13);
    }
}

TEST_CASE("five stages are asked for where a step turns the body by more than a milliradian") {
    CHECK(rotor_stages(Vec3(0.5, 0, 0), 1e-3) == 1);
    CHECK(rotor_stages(Vec3(0, 2, 0), 1e-3) == 5);
    CHECK(rotor_stages(Vec3(0, 0, 40), 1e-3) == 10);
    CHECK(rotor_stages(Vec3::Zero(), 1) == 1);
}
