#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

using namespace cairn;
using namespace cairn::solver_test;

namespace {

// Central differences with e = 1e-5: they miss e²/6 C''' (arms to 4 m, ‖w‖ to 1.8 rad/s, rods of 0.5 m at least: C''' below 200, so
// 4e-9) and a rounding of C over e (1e-15 / 1e-5 = 1e-10). G has norm one at least.
constexpr Real kStep = 1e-5;
constexpr Real kTolerance = 1e-7;

// Sizes at run time: one instance of products and inverses for all joints, which the compiler is through with in a fraction of the time.
using Dense = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

// Largest difference, relative to ‖G‖, between G u and what C does along u.
template <JointKind K>
Real largest_error(const JointGeometry& g, const JointPose& a, const JointPose& b, const std::vector<Vec12>& directions) {
    constexpr int N = joint_rows(K);
    Jacobian<N> G_a, G_b;
    joint_jacobian<K>(g, a, b, G_a, G_b);
    Dense G(N, 12);
    G << G_a, G_b;
    Real worst = 0;
    for (const Vec12& u : directions) {
        const auto error_at = [&](Real e) -> VecN<N> {
            return joint_error<K>(g, displaced(a, u.segment<3>(0), u.segment<3>(3), e), displaced(b, u.segment<3>(6), u.segment<3>(9), e));
        };
        const VecN<N> rate = (error_at(kStep) - error_at(-kStep)) / (2 * kStep);
        worst = std::max(worst, (rate - G * u).norm() / G.norm());
    }
    return worst;
}

// All columns and one mixed direction.
std::vector<Vec12> directions_for(Random& random) {
    std::vector<Vec12> u(13);
    for (int k = 0; k < 12; ++k) u[k] = Vec12::Unit(k);
    for (int k = 0; k < 12; k += 3) u[12].segment<3>(k) = random_vector(random);
    return u;
}

template <JointKind K>
void check_jacobian() {
    Random random(11 + static_cast<int>(K));
    Real worst_far = 0, worst_near = 0;
    for (int i = 0; i < 1000; ++i) {
        const JointPose a{random_vector(random), random_rotation(random).toRotationMatrix()};
        const JointPose b{random_vector(random), random_rotation(random).toRotationMatrix()};
        const Vec3 far_offset = uniform(random, 0.5, 2) * random_direction(random);
        JointGeometry far = joint_between(random, a, b, far_offset, random_rotation(random));
        far.length = uniform(random, 0, 2);
        worst_far = std::max(worst_far, largest_error<K>(far, a, b, directions_for(random)));
        // Rods have a length; the others nearly meet.
        const Vec3 near_offset = K == JointKind::kDistance ? far_offset : Vec3(random_vector(random, 1e-3));
        const JointGeometry near = joint_between(random, a, b, near_offset, random_rotation(random, 1e-3));
        worst_near = std::max(worst_near, largest_error<K>(near, a, b, directions_for(random)));
    }
    CHECK(worst_far < kTolerance);
    CHECK(worst_near < kTolerance);
}

template <JointKind K>
void check_masses() {
    constexpr int N = joint_rows(K);
    Random random(31 + static_cast<int>(K));
    Real worst_W = 0, worst_inverse = 0;
    for (int i = 0; i < 1000; ++i) {
        Island island;
        const int fixed = island.add_body(immovable_body(random_vector(random), random_rotation(random)), {});
        const int first = island.add_body(random_body(random), {}), second = island.add_body(random_body(random), {});
        const int a = i % 4 == 0 ? fixed : first, b = i % 4 == 1 ? fixed : second;
        const BodyMotion &body_a = island.bodies.motion[a], &body_b = island.bodies.motion[b];
        // Angular rows of frames at right angles would be dependent: joints stay within half a radian.
        const Vec3 offset = random_vector(random, 0.2) + Vec3(K == JointKind::kDistance, 0, 0);
        add_joint<K>(island, a, b, joint_between(random, {body_a.x, body_a.R}, {body_b.x, body_b.R}, offset, random_rotation(random, 0.5)));

        const JointBlock<N>& joint = pool_of<K>(island.joints)[0];
        Dense G(N, 12), W(12, N);
        G << joint.G_a, joint.G_b;
        W << joint.W_a, joint.W_b;
        const Dense dense_W = Dense(dense_inverse_mass(body_a, body_b)) * G.transpose();
        const Dense S = G * dense_W;
        worst_W = std::max(worst_W, (W - dense_W).norm() / dense_W.norm());
        worst_inverse = std::max(worst_inverse, (joint.inv_S - Dense(S.inverse())).norm() / joint.inv_S.norm());
        if (a == fixed && !joint.W_a.isZero(0)) FAIL("an immovable body takes part");
        if (b == fixed && !joint.W_b.isZero(0)) FAIL("an immovable body takes part");
    }
    // W: products of a dozen roundings, the tensors inverted twice (condition to 11): 1e-14. S⁻¹: the same times the condition of S, which
    // is below a thousand for these arms and masses.
    CHECK(worst_W < 1e-13);
    CHECK(worst_inverse < 1e-12);
}

}  // namespace

TEST_CASE("G of a ball joint is the derivative of its C") {
    check_jacobian<JointKind::kBall>();
}
TEST_CASE("G of a hinge is the derivative of its C") {
    check_jacobian<JointKind::kHinge>();
}
TEST_CASE("G of a slider is the derivative of its C, however far it has slid") {
    check_jacobian<JointKind::kSlider>();
}
TEST_CASE("G of a fixed joint is the derivative of its C") {
    check_jacobian<JointKind::kFixed>();
}
TEST_CASE("G of a distance joint is the derivative of its C") {
    check_jacobian<JointKind::kDistance>();
}

TEST_CASE("a ball joint's mass matrices are those of the dense product") {
    check_masses<JointKind::kBall>();
}
TEST_CASE("a hinge's mass matrices are those of the dense product") {
    check_masses<JointKind::kHinge>();
}
TEST_CASE("a slider's mass matrices are those of the dense product") {
    check_masses<JointKind::kSlider>();
}
TEST_CASE("a fixed joint's mass matrices are those of the dense product") {
    check_masses<JointKind::kFixed>();
}
TEST_CASE("a distance joint's mass matrices are those of the dense product") {
    check_masses<JointKind::kDistance>();
}

TEST_CASE("a joint that is met has no error and one that is not has that of its definition") {
    Random random(7);
    for (int i = 0; i < 100; ++i) {
        const JointPose a{random_vector(random), random_rotation(random).toRotationMatrix()};
        const JointPose b{random_vector(random), random_rotation(random).toRotationMatrix()};
        const JointGeometry met = joint_between(random, a, b, Vec3::Zero(), Quat::Identity());
        // A dozen roundings of lengths of a few metres.
        CHECK(joint_error<JointKind::kBall>(met, a, b).norm() < 1e-14);
        CHECK(joint_error<JointKind::kHinge>(met, a, b).norm() < 1e-14);
        CHECK(joint_error<JointKind::kSlider>(met, a, b).norm() < 1e-14);
        CHECK(joint_error<JointKind::kFixed>(met, a, b).norm() < 1e-14);
        CHECK(std::abs(joint_error<JointKind::kDistance>(met, a, b)[0]) < 1e-14);

        // What a hinge leaves free (turning about e_0) and a slider (moving along e_0) changes nothing.
        JointGeometry turned = met;
        turned.frame_B = met.frame_B * exp_rotation(Vec3(uniform(random, -3, 3), 0, 0)).toRotationMatrix();
        CHECK(joint_error<JointKind::kHinge>(turned, a, b).norm() < 1e-14);
        const Vec3 axis = a.R * met.frame_A.col(0);
        const JointPose slid{a.x + uniform(random, -3, 3) * axis, a.R};
        CHECK(joint_error<JointKind::kSlider>(met, slid, b).norm() < 1e-14);

        // A offset by d in World: the error is d, or what of it lies across the axis.
        const Vec3 d = random_vector(random);
        const JointPose off{a.x + d, a.R};
        CHECK((joint_error<JointKind::kBall>(met, off, b) - d).norm() < 1e-14);
        CHECK((joint_error<JointKind::kHinge>(met, off, b).head<3>() - d).norm() < 1e-14);
        CHECK((joint_error<JointKind::kFixed>(met, off, b).head<3>() - d).norm() < 1e-14);
        CHECK(std::abs(joint_error<JointKind::kDistance>(met, off, b)[0] - d.norm()) < 1e-14);
        CHECK(std::abs(joint_error<JointKind::kSlider>(met, off, b).head<2>().norm() - axis.cross(d).norm()) < 1e-14);

        // A turned by φ about e_k: the fixed joint's k-th angle is sin φ, the others zero.
        const int k = i % 3;
        const Real angle = uniform(random, -0.5, 0.5);
        const JointPose tilted{a.x, exp_rotation(angle * a.R * met.frame_A.col(k)).toRotationMatrix() * a.R};
        CHECK((joint_error<JointKind::kFixed>(met, tilted, b).tail<3>() - std::sin(angle) * Vec3::Unit(k)).norm() < 1e-14);
    }
}

TEST_CASE("joint ranges count joints and rows of every kind") {
    CHECK(joint_rows(JointKind::kBall) == 3);
    CHECK(joint_rows(JointKind::kHinge) == 5);
    CHECK(joint_rows(JointKind::kSlider) == 5);
    CHECK(joint_rows(JointKind::kFixed) == 6);
    CHECK(joint_rows(JointKind::kDistance) == 1);

    JointRanges ranges;
    CHECK(ranges.empty());
    CHECK(ranges.count() == 0);
    CHECK(ranges.rows() == 0);
    const int rows[5] = {3, 5, 5, 6, 1};
    int joints = 0, expected = 0;
    for (int k = 0; k < 5; ++k) {
        ranges.begin[k] = 10 * k;
        ranges.end[k] = 10 * k + k + 1;
        joints += k + 1;
        expected += (k + 1) * rows[k];
        JointRanges alone;
        alone.begin[k] = alone.end[k] = 7;
        CHECK(alone.empty());
        alone.end[k] = 8;
        CHECK_FALSE(alone.empty());
        CHECK(alone.rows() == rows[k]);
    }
    CHECK_FALSE(ranges.empty());
    CHECK(ranges.count() == joints);
    CHECK(ranges.rows() == expected);
}
