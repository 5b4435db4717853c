// Natural-map residuals against their definition.
#include "solver/residual.hpp"

#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <algorithm>
#include <cmath>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

// Two random bodies with a manifold of two points, rubbing, with random impulses.
Island random_touch(Random& random, Real mu) {
    Island island;
    for (int k = 0; k < 2; ++k) island.add_body(random_body(random), {random_vector(random), random_vector(random)});
    const Vec3 n = random_direction(random);
    std::vector<PointGeometry> points(2);
    for (PointGeometry& g : points) {
        const Vec3 p = random_vector(random);
        const BodyMotion &a = island.bodies.motion[1], &b = island.bodies.motion[2];
        g.core_a_A = a.R.transpose() * (p - a.x);
        g.core_b_B = b.R.transpose() * (p - b.x);
    }
    island.add_contact(1, 2, n, NormalFrame::kWorld, points, mu);
    for (PointImpulse& x : island.contacts.impulse) x = {uniform(random, 0, 1), {uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2)}};
    return island;
}

// G v along d at the first body's point, from the velocities of the two material points.
Real relative_velocity(const Island& island, int point, const Vec3& d) {
    const PointGeometry& g = island.contacts.geometry[point];
    const auto velocity = [&](int body, const Vec3& core) -> Vec3 {
        return island.bodies.velocity[body].v + island.bodies.velocity[body].w.cross(island.bodies.motion[body].R * core);
    };
    return d.dot(velocity(1, g.core_a_A) - velocity(2, g.core_b_B));
}

ResidualMeasure measure(const Island& island, FrictionModel friction) {
    ResidualMeasure m;
    add_contact_residual(island.contacts, island.range.contacts, island.contacts.impulse, island.bodies, friction, nullptr, m);
    return m;
}

}  // namespace

TEST_CASE("a row's residual is what one more visit of it would change of its velocity") {
    const int seed = GENERATE(range(0, 50));
    CAPTURE(seed);
    Random random(seed);
    Island island = random_touch(random, 0.5);
    Real largest = 0, squares = 0;
    for (int p = 0; p < 2; ++p) {
        const NormalRow& row = island.contacts.normals[p];
        const PointImpulse& x = island.contacts.impulse[p];
        const Real w = relative_velocity(island, p, island.contacts.blocks[0].n);
        Real residual[3] = {std::abs(x.normal - std::max(x.normal - row.mass * w, 0.0)) / row.mass, 0, 0};
        for (int j = 0; j < 2; ++j) {
            const FrictionRow& f = island.contacts.frictions[2 * p + j];
            const Real step = x.friction[j] - f.mass * relative_velocity(island, p, f.t), bound = 0.5 * x.normal;
            residual[1 + j] = std::abs(x.friction[j] - std::clamp(step, -bound, bound)) / f.mass;
        }
        for (const Real r : residual) {
            largest = std::max(largest, r);
            squares += r * r;
        }
    }
    const ResidualMeasure m = measure(island, FrictionModel::kPyramid);
    CHECK(m.rows == 6);
    CHECK(m.index == 0);
    // Sums of some ten products of numbers up to 10.
    CHECK(std::abs(m.max - largest) < 1e-13 * (1 + largest));
    CHECK(std::abs(m.sum_of_squares - squares) < 1e-12 * (1 + squares));
}

TEST_CASE("a row that does not touch and bears nothing has no residual, however fast it parts or nears") {
    Random random(1);
    Island island = random_touch(random, 0);
    for (int p = 0; p < 2; ++p) {
        island.contacts.impulse[p] = {};
        island.contacts.normals[p].touching = false;
    }
    CHECK(measure(island, FrictionModel::kPyramid).max == 0);
}

TEST_CASE("the residual of a joint's angle is the speed of the radius of gyration about its axis") {
    Random random(2);
    Island island;
    BodyMotion rod = random_body(random);
    set_pose(rod, Vec3::Zero(), Quat::Identity());
    rod.inv_mass = 0.5;
    rod.inv_inertia_B = Vec3(1 / 0.1, 1 / 3.0, 1 / 3.0).asDiagonal();
    rod.inv_inertia_W = rod.inv_inertia_B;
    const int body = island.add_body(rod, {Vec3::Zero(), Vec3(0, 2, 0)});  // 2 rad/s about y
    JointGeometry hinge;                                                   // about x, at the centre
    add_joint<JointKind::kHinge>(island, body, kImmovable, hinge);
    ResidualMeasure m;
    add_joint_residual(island.joints, island.range.joints, island.bodies, false, m);
    CHECK(m.rows == 5);
    CHECK(m.kind == RowKind::kJoint);
    CHECK(m.joint_kind == static_cast<int>(JointKind::kHinge));
    CHECK(std::abs(m.max - 2 * std::sqrt(3.0 * 0.5)) < 1e-14);  // sqrt(I / m)
}

TEST_CASE("of equal residuals the first is the worst, and none is none") {
    ResidualMeasure m;
    m.add(0, RowKind::kNormal, 0, 3);
    CHECK(m.kind == RowKind::kNone);
    m.add(2, RowKind::kFriction, 0, 4);
    m.add(2, RowKind::kNormal, 0, 5);
    CHECK(m.kind == RowKind::kFriction);
    CHECK(m.index == 4);
    CHECK(m.rows == 3);
}
