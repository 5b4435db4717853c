#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

using namespace cairn;
using namespace cairn::solver_test;

namespace {

// Central differences with e = 1e-5: they miss e²/6 C''' (arms to 4 m, rates to 1.8: below 1e-8) and a rounding of C over e (1e-10).
constexpr Real kStep = 1e-5;
constexpr Real kTolerance = 1e-7;

// G of a row along `direction`, as the header writes it.
Vec12 dense_row(const Vec3& direction, const PointRow& row) {
    Vec12 G;
    G << direction, row.ang_a, -direction, -row.ang_b;
    return G;
}

// A scene of two random bodies in one point contact. With `lateral`, the cores are not on one perpendicular.
struct PointContact {
    Island island;
    PointGeometry point;
    Vec3 n;
    NormalFrame frame;

    PointContact(Random& random, NormalFrame frame_, bool lateral, int i) : n(random_direction(random)), frame(frame_) {
        const bool fixed_b = i % 4 == 0;
        const int a = island.add_body(random_body(random), {random_vector(random), random_vector(random)});
        int b = kImmovable;
        if (!fixed_b) b = island.add_body(random_body(random), {random_vector(random), random_vector(random)});
        const BodyMotion &body_a = island.bodies.motion[a], &body_b = island.bodies.motion[b];
        point.core_a_A = random_vector(random);
        point.radius_a = i % 3 == 0 ? 0 : uniform(random, 0, 0.5);
        point.radius_b = i % 5 == 0 ? 0 : uniform(random, 0, 0.5);
        const Real separation = uniform(random, -0.1, 0.1);
        Vec3 core_b = body_a.x + body_a.R * point.core_a_A - (separation + point.radius_a + point.radius_b) * n;
        if (lateral) core_b += uniform(random, 0, 1) * n.cross(random_direction(random));
        point.core_b_B = body_b.R.transpose() * (core_b - body_b.x);
        island.add_contact(a, b, n, frame, {point}, 0.5);
    }

    const ContactBlock& block() const { return island.contacts.blocks[0]; }
    const BodyMotion& body_a() const { return island.bodies.motion[block().a]; }
    const BodyMotion& body_b() const { return island.bodies.motion[block().b]; }
    JointPose pose_a() const { return {body_a().x, body_a().R}; }
    JointPose pose_b() const { return {body_b().x, body_b().R}; }

    // C at other poses: the material core points, the normal turning with the body that owns it.
    Real separation_at(const JointPose& a, const JointPose& b) const {
        Vec3 normal = n;
        if (frame == NormalFrame::kA) normal = a.R * body_a().R.transpose() * n;
        if (frame == NormalFrame::kB) normal = b.R * body_b().R.transpose() * n;
        return normal.dot(a.x + a.R * point.core_a_A - b.x - b.R * point.core_b_B) - point.radius_a - point.radius_b;
    }
};

// (f(e) − f(−e)) / 2e along u of a function of the two poses.
template <typename Function>
Real rate_along(const PointContact& contact, const Vec12& u, Function f) {
    const auto at = [&](Real e) {
        return f(displaced(contact.pose_a(), u.segment<3>(0), u.segment<3>(3), e),
                 displaced(contact.pose_b(), u.segment<3>(6), u.segment<3>(9), e));
    };
    return (at(kStep) - at(-kStep)) / (2 * kStep);
}

template <typename Function>
Real largest_error(const PointContact& contact, const Vec12& G, Random& random, Function f) {
    Real worst = 0;
    for (int k = 0; k < 13; ++k) {
        Vec12 u = Vec12::Unit(std::min(k, 11));
        if (k == 12)
            for (int j = 0; j < 12; j += 3) u.segment<3>(j) = random_vector(random);
        worst = std::max(worst, std::abs(rate_along(contact, u, f) - G.dot(u)) / G.norm());
    }
    return worst;
}

}  // namespace

TEST_CASE("G of a row is the derivative of the distance of two material points along a direction") {
    Random random(1);
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        const BodyMotion a = random_body(random), b = random_body(random);
        const Vec3 direction = random_direction(random), r_a = random_vector(random), r_b = random_vector(random);
        const Vec12 G = dense_row(direction, make_point_row(direction, r_a, r_b, a, b));
        for (int k = 0; k < 13; ++k) {
            Vec12 u = Vec12::Unit(std::min(k, 11));
            if (k == 12)
                for (int j = 0; j < 12; j += 3) u.segment<3>(j) = random_vector(random);
            const auto distance = [&](Real e) {
                const Vec3 p_a = a.x + e * u.segment<3>(0) + exp_rotation(e * u.segment<3>(3)) * r_a;
                const Vec3 p_b = b.x + e * u.segment<3>(6) + exp_rotation(e * u.segment<3>(9)) * r_b;
                return direction.dot(p_a - p_b);
            };
            worst = std::max(worst, std::abs((distance(kStep) - distance(-kStep)) / (2 * kStep) - G.dot(u)) / G.norm());
        }
    }
    CHECK(worst < kTolerance);
}

TEST_CASE("a contact's normal row is the derivative of its separation while the normal stands still") {
    Random random(2);
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        const PointContact contact(random, NormalFrame::kWorld, false, i);
        const Vec12 G = dense_row(contact.block().n, contact.island.contacts.normals[0]);
        worst = std::max(
            worst, largest_error(contact, G, random, [&](const JointPose& a, const JointPose& b) { return contact.separation_at(a, b); }));
    }
    CHECK(worst < kTolerance);
}

TEST_CASE("a contact's normal row is the derivative of its separation while the normal turns with the body that owns it") {
    const NormalFrame frame = GENERATE(NormalFrame::kA, NormalFrame::kB);
    CAPTURE(static_cast<int>(frame));
    Random random(3);
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        const PointContact contact(random, frame, true, i);
        const Vec12 G = dense_row(contact.block().n, contact.island.contacts.normals[0]);
        worst = std::max(
            worst, largest_error(contact, G, random, [&](const JointPose& a, const JointPose& b) { return contact.separation_at(a, b); }));
    }
    CHECK(worst < kTolerance);
}

TEST_CASE("friction rows are the derivative of the tangential distance of the surface points") {
    const NormalFrame frame = GENERATE(NormalFrame::kWorld, NormalFrame::kA, NormalFrame::kB);
    CAPTURE(static_cast<int>(frame));
    Random random(4);
    Real worst = 0, worst_frame = 0;
    for (int i = 0; i < 1000; ++i) {
        const PointContact contact(random, frame, frame != NormalFrame::kWorld, i);
        const BodyMotion &a = contact.body_a(), &b = contact.body_b();
        const Real separation = contact.separation_at(contact.pose_a(), contact.pose_b());
        // The side that owns the normal is the face: the other's surface point and its foot on the face.
        Vec3 p_a, p_b;
        if (frame == NormalFrame::kA) {
            p_b = b.x + b.R * contact.point.core_b_B + contact.point.radius_b * contact.n;
            p_a = p_b + separation * contact.n;
        } else {
            p_a = a.x + a.R * contact.point.core_a_A - contact.point.radius_a * contact.n;
            p_b = p_a - separation * contact.n;
        }
        const Vec3 at_a = a.R.transpose() * (p_a - a.x), at_b = b.R.transpose() * (p_b - b.x);
        const FrictionRow* rows = &contact.island.contacts.frictions[contact.block().friction];
        for (int k = 0; k < 2; ++k) {
            const Vec3 t = rows[k].t;
            worst = std::max(worst, largest_error(contact, dense_row(t, rows[k]), random, [&](const JointPose& pa, const JointPose& pb) {
                                 return t.dot(pa.x + pa.R * at_a - pb.x - pb.R * at_b);
                             }));
        }
        Mat3 frame_error;
        frame_error << rows[0].t, rows[1].t, contact.block().n;
        worst_frame = std::max(worst_frame, (frame_error.transpose() * frame_error - Mat3::Identity()).norm());
        worst_frame = std::max(worst_frame, (contact.block().n.cross(rows[0].t) - rows[1].t).norm());
    }
    CHECK(worst < kTolerance);
    CHECK(worst_frame < 1e-13);  // a few roundings, twenty times as many where t₁ starts within 3° of n
}

TEST_CASE("a contact row's masses are those of the dense product") {
    Random random(5);
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        const BodyMotion fixed = immovable_body(random_vector(random), random_rotation(random));
        const BodyMotion first = random_body(random), second = random_body(random);
        const BodyMotion &a = i % 4 == 0 ? fixed : first, &b = i % 4 == 1 ? fixed : second;
        const Vec3 direction = random_direction(random), r_a = random_vector(random), r_b = random_vector(random);
        const PointRow row = make_point_row(direction, r_a, r_b, a, b);
        Vec12 G, W;
        G << direction, r_a.cross(direction), -direction, -r_b.cross(direction);
        W << a.inv_mass * direction, row.iang_a, -b.inv_mass * direction, -row.iang_b;
        const Vec12 dense_W = dense_inverse_mass(a, b) * G;
        worst = std::max(worst, (W - dense_W).norm() / dense_W.norm());
        worst = std::max(worst, std::abs(row.mass * G.dot(dense_W) - 1));
    }
    // A dozen roundings, the tensors inverted twice at a condition of 11 at most.
    CHECK(worst < 1e-13);

    const BodyMotion fixed = immovable_body(Vec3::Zero(), Quat::Identity());
    CHECK(make_point_row(Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY(), fixed, fixed).mass == 0);
}

TEST_CASE("the rows of a block carry the masses of its bodies at the surface points") {
    Random random(6);
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        const NormalFrame frame = static_cast<NormalFrame>(i % 3);
        const PointContact contact(random, frame, false, i);
        const ContactBlock& block = contact.block();
        const Mat12 inverse_mass = dense_inverse_mass(contact.body_a(), contact.body_b());
        const FrictionRow* friction = &contact.island.contacts.frictions[block.friction];
        const PointRow rows[3] = {contact.island.contacts.normals[0], friction[0], friction[1]};
        const Vec3 directions[3] = {block.n, friction[0].t, friction[1].t};
        for (int k = 0; k < 3; ++k) {
            const Vec12 G = dense_row(directions[k], rows[k]);
            worst = std::max(worst, std::abs(rows[k].mass * G.dot(inverse_mass * G) - 1));
        }
    }
    CHECK(worst < 1e-13);
}

TEST_CASE("the separation of a block is the gap between its surfaces along the normal") {
    Random random(7);
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        const PointContact contact(random, static_cast<NormalFrame>(i % 3), i % 2 == 0, i);
        worst = std::max(
            worst, std::abs(contact.island.contacts.normals[0].separation - contact.separation_at(contact.pose_a(), contact.pose_b())));
    }
    CHECK(worst < 1e-14);  // a dozen roundings of a few metres
}

// Second differences with e = 1e-4: e²/12 C'''' (below 100, so 1e-7) and four roundings of C over e² (1e-15 / 1e-8 = 1e-7).
TEST_CASE("the curvature of a row is the second derivative of its separation while the body that owns the normal does not turn") {
    const NormalFrame frame = GENERATE(NormalFrame::kWorld, NormalFrame::kA, NormalFrame::kB);
    CAPTURE(static_cast<int>(frame));
    Random random(8);
    constexpr Real e = 1e-4;
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        PointContact contact(random, frame, false, i);
        BodyVelocity& a = contact.island.bodies.velocity[contact.block().a];
        BodyVelocity& b = contact.island.bodies.velocity[contact.block().b];
        if (frame == NormalFrame::kA) a.w.setZero();
        if (frame == NormalFrame::kB) b.w.setZero();
        build_block(contact.island.contacts, contact.island.contacts.blocks[0], contact.island.bodies);
        const auto at = [&](Real time) {
            return contact.separation_at(displaced(contact.pose_a(), a.v, a.w, time), displaced(contact.pose_b(), b.v, b.w, time));
        };
        const Real curvature = (at(e) - 2 * at(0) + at(-e)) / (e * e);
        worst = std::max(worst, std::abs(curvature - contact.island.contacts.normals[0].curvature));
    }
    CHECK(worst < 1e-6);
}

TEST_CASE("the body that owns the normal adds no curvature: its face is taken as flat") {
    const NormalFrame frame = GENERATE(NormalFrame::kA, NormalFrame::kB);
    Random random(18);
    for (int i = 0; i < 100; ++i) {
        PointContact contact(random, frame, false, 1);
        contact.island.bodies.velocity[frame == NormalFrame::kA ? contact.block().b : contact.block().a].w.setZero();
        build_block(contact.island.contacts, contact.island.contacts.blocks[0], contact.island.bodies);
        CHECK(contact.island.contacts.normals[0].curvature == 0);
    }
}

TEST_CASE("tangents stay where they were when rows are built again, but for what the normal's turn takes") {
    Random random(9);
    for (int i = 0; i < 100; ++i) {
        PointContact contact(random, NormalFrame::kB, false, 1);
        ContactPool& pool = contact.island.contacts;
        ContactBlock& block = pool.blocks[0];
        const Vec3 before = pool.frictions[block.friction].t;
        build_block(pool, block, contact.island.bodies);
        CHECK((pool.frictions[block.friction].t - before).norm() < 2e-14);  // likewise

        BodyMotion& b = contact.island.bodies.motion[block.b];
        set_pose(b, b.x, exp_rotation(random_vector(random, 0.3)) * b.q);
        build_block(pool, block, contact.island.bodies);
        const Vec3 after = pool.frictions[block.friction].t;
        CHECK((after - (before - block.n * block.n.dot(before)).normalized()).norm() < 2e-14);
        CHECK((block.n - b.R * block.n_local).norm() == 0);
    }
}

TEST_CASE("separations advanced along the velocities are those of the moved bodies, rows of bodies that turned are built again") {
    Random random(10);
    Real worst = 0;
    for (int i = 0; i < 1000; ++i) {
        PointContact contact(random, static_cast<NormalFrame>(i % 3), false, i);
        SolverBodies& bodies = contact.island.bodies;
        const bool turns = i % 2 == 0;
        if (!turns)
            for (BodyVelocity& u : bodies.velocity) u.w.setZero();
        const Real h = 0.01;
        drift(bodies, 1, bodies.size(), h);
        advance_blocks(contact.island.contacts, contact.island.range.contacts, bodies, h, 1e-9);
        // n of a block that is held by no body stands still; contact.n is the normal of the poses before.
        Vec3 n = contact.n;
        if (contact.frame == NormalFrame::kA) n = bodies.motion[contact.block().a].R * contact.block().n_local;
        if (contact.frame == NormalFrame::kB) n = bodies.motion[contact.block().b].R * contact.block().n_local;
        const BodyMotion &a = contact.body_a(), &b = contact.body_b();
        const Real expected = n.dot(a.x + a.R * contact.point.core_a_A - b.x - b.R * contact.point.core_b_B) - contact.point.radius_a -
                              contact.point.radius_b;
        worst = std::max(worst, std::abs(contact.island.contacts.normals[0].separation - expected));
    }
    CHECK(worst < 1e-14);
}
