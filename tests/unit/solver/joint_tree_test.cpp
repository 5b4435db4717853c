// Trees of joints in their own coordinates, against the factor of G M⁻¹ Gᵀ; contact rows in them.
#include "solver/mixed.hpp"
#include "solver/tree_contacts.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <algorithm>
#include <array>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

template <JointKind K>
void join_at_random(Random& random, Island& island, int a, int b) {
    const BodyMotion &A = island.bodies.motion[a], &B = island.bodies.motion[b];
    const Vec3 offset = K == JointKind::kDistance ? random_vector(random) : Vec3(Vec3::Zero());
    add_joint<K>(island, a, b, joint_between(random, {A.x, A.R}, {B.x, B.R}, offset, Quat::Identity()));
}

void join_at_random(Random& random, Island& island, int a, int b) {
    if (random() % 2) std::swap(a, b);
    switch (random() % 5) {
        case 0:
            return join_at_random<JointKind::kBall>(random, island, a, b);
        case 1:
            return join_at_random<JointKind::kHinge>(random, island, a, b);
        case 2:
            return join_at_random<JointKind::kSlider>(random, island, a, b);
        case 3:
            return join_at_random<JointKind::kFixed>(random, island, a, b);
        default:
            return join_at_random<JointKind::kDistance>(random, island, a, b);
    }
}

// Two trees, one of them on a kinematic body, and a body alone.
Island random_forest(Random& random) {
    constexpr int kBodies = 13;
    Island island;
    for (int i = 0; i < kBodies; ++i) island.add_body(random_body(random), {random_vector(random), random_vector(random)});
    const int base =
        island.add_body(immovable_body(random_vector(random), random_rotation(random)), {random_vector(random), random_vector(random)});
    island.range.dynamic_end = base;
    for (int i = 2; i < 7; ++i) join_at_random(random, island, i, 1 + static_cast<int>(random() % (i - 1)));
    for (int i = 8; i < kBodies; ++i) join_at_random(random, island, i, 7 + static_cast<int>(random() % (i - 7)));
    join_at_random(random, island, 9, base);
    return island;
}

struct Rows {
    JointPlans plans;
    JointRowList list;
    BlockLdlt ldlt;
    const JointPlan* plan = nullptr;
    JointTree tree;

    explicit Rows(const Island& island) {
        const JointRanges& joints = island.range.joints;
        plan = &plans.find(island.joints, joints, island.bodies, island.range.body_begin, 1e9);
        list.gather(island.joints, joints, island.bodies, *plan);
        list.build(island.joints, joints, island.bodies);
        list.assemble(*plan, ldlt);
        ldlt.factor(1e-14);
        tree.gather(plan->tree, list, island.range.body_begin, island.range.dynamic_end);
        tree.build(island.joints, joints, island.bodies);
    }

    std::vector<Real> velocities(const Island& island) const {
        std::vector<Real> r(list.rows());
        list.velocities(island.bodies, r.data());
        return r;
    }
};

Real distance(const SolverBodies& p, const SolverBodies& q) {
    Real d = 0;
    for (int i = 0; i < p.size(); ++i)
        d = std::max({d, (p.velocity[i].v - q.velocity[i].v).norm(), (p.velocity[i].w - q.velocity[i].w).norm()});
    return d;
}

void add_contacts(Random& random, Island& island) {
    for (int k = 0; k < 12; ++k) {
        const int a = 1 + static_cast<int>(random() % (island.range.dynamic_end - 1));
        const int b = k % 2 ? 0 : 1 + static_cast<int>(random() % (island.range.dynamic_end - 1));
        if (a == b) continue;
        const BodyMotion &A = island.bodies.motion[a], &B = island.bodies.motion[b];
        std::vector<PointGeometry> points(1 + random() % 3);
        for (PointGeometry& g : points) {
            const Vec3 p = A.x + random_vector(random, 0.3);
            g.core_a_A = A.R.transpose() * (p - A.x);
            g.core_b_B = B.R.transpose() * (p - B.x);
        }
        island.add_contact(a, b, random_direction(random), NormalFrame::kWorld, points, random() % 4 ? 0.5 : 0);
    }
}

// Relative velocity of a row.
Real along(const Island& island, const ContactBlock& block, const Vec3& direction, const PointRow& row) {
    const BodyVelocity &a = island.bodies.velocity[block.a], &b = island.bodies.velocity[block.b];
    return direction.dot(a.v - b.v) + row.ang_a.dot(a.w) - row.ang_b.dot(b.w);
}

}  // namespace

TEST_CASE("a chain hangs from its middle, a tree from the body that hangs from the world, and rings are no trees") {
    const int ball = static_cast<int>(JointKind::kBall);
    const TreePlan chain = plan_tree({ball, 0, 1, ball, 2, 1, ball, 2, 3, ball, 3, 4});
    REQUIRE(chain.is_forest);
    REQUIRE(chain.nodes.size() == 5);
    CHECK(chain.nodes[0].body == 2);
    CHECK(chain.nodes[0].joint == -1);
    for (std::size_t i = 1; i < chain.nodes.size(); ++i) CHECK(chain.nodes[i].parent < static_cast<int>(i));

    const TreePlan hanging = plan_tree({ball, 0, 1, ball, 1, 2, ball, -1, 0});
    REQUIRE(hanging.is_forest);
    CHECK(hanging.nodes[0].body == 0);
    CHECK(hanging.nodes[0].joint == 2);
    CHECK(hanging.nodes[0].side == 1);

    CHECK_FALSE(plan_tree({ball, 0, 1, ball, 1, 2, ball, 2, 0}).is_forest);
    CHECK_FALSE(plan_tree({ball, 0, 1, ball, 0, 1}).is_forest);
    CHECK_FALSE(plan_tree({ball, -1, 0, ball, 0, 1, ball, 1, -1}).is_forest);
    CHECK_FALSE(plan_tree({ball, 0, 1, ball, 1, 2, ball, 2, 3, ball, 3, 1}).is_forest);
}

TEST_CASE("velocities, corrections and impulses of a tree of joints are those of the factor") {
    const unsigned seed = GENERATE(range(1u, 9u));
    CAPTURE(seed);
    Random random(seed);
    Island island = random_forest(random);
    Rows rows(island);
    REQUIRE(rows.plan->tree.is_forest);
    const int n = rows.list.rows();
    std::vector<Real> wanted(n), lambda(n), found(n);
    for (Real& r : wanted) r = uniform(random, -1, 1);

    Island direct = island;
    lambda = rows.velocities(island);
    for (int r = 0; r < n; ++r) lambda[r] = wanted[r] - lambda[r];
    rows.ldlt.solve(lambda.data());
    rows.list.apply(lambda.data(), direct.bodies);
    const Real scale = *std::max_element(lambda.begin(), lambda.end());

    Island projected = island;
    rows.tree.project(wanted.data(), projected.bodies);
    CHECK(distance(projected.bodies, direct.bodies) < 1e-9);
    rows.tree.joint_impulses(projected.bodies, found.data());
    for (int r = 0; r < n; ++r) CHECK(found[r] == Approx(lambda[r]).margin(1e-9 * scale));

    // From velocities that hold, to others.
    lambda = wanted;
    rows.ldlt.solve(lambda.data());
    rows.list.apply(lambda.data(), direct.bodies);
    rows.tree.correct(wanted.data(), projected.bodies);
    CHECK(distance(projected.bodies, direct.bodies) < 1e-9);
}

TEST_CASE("contacts swept in a tree's coordinates leave its joints alone and are met by the bodies' velocities") {
    const unsigned seed = GENERATE(range(1u, 9u));
    CAPTURE(seed);
    Random random(seed);
    Island island = random_forest(random);
    island.bodies.velocity[island.range.dynamic_end] = {};  // what a kinematic body does need not agree with contacts
    add_contacts(random, island);
    Rows rows(island);
    TreeContacts contacts;
    const BlockRange range = island.range.contacts;
    REQUIRE(contacts.gather(rows.tree, island.contacts, range, island.range.body_begin, island.range.dynamic_end));
    contacts.build(island.contacts, range);
    const Island before = island;
    rows.tree.project(nullptr, island.bodies);
    contacts.begin_velocities(island.contacts, range, island.bodies);
    Real change = 1;
    for (int k = 0; k < 20000 && change > 1e-12; ++k) change = contacts.sweep(island.contacts, true);
    REQUIRE(change < 1e-8);
    rows.tree.add_motion(contacts.motion(), island.bodies);
    for (Real r : rows.velocities(island)) CHECK(std::abs(r) < 1e-9);

    // Impulses of contacts and joints are all that the bodies have got.
    std::vector<Real> lambda(rows.list.rows());
    contacts.note_impulses(island.contacts, range, true, rows.tree);
    rows.tree.joint_impulses(island.bodies, lambda.data());
    Island sum = before;
    rows.list.apply(lambda.data(), sum.bodies);
    for (const ContactBlock& block : island.contacts.blocks) {
        for (int i = 0; i < block.count; ++i) {
            const PointImpulse& x = island.contacts.impulse[block.first + i];
            const auto apply = [&](const Vec3& t, const PointRow& row, Real l) {
                sum.bodies.velocity[block.a].v += block.inv_mass_a * l * t;
                sum.bodies.velocity[block.b].v -= block.inv_mass_b * l * t;
                sum.bodies.velocity[block.a].w += l * row.iang_a;
                sum.bodies.velocity[block.b].w -= l * row.iang_b;
            };
            const NormalRow& normal = island.contacts.normals[block.first + i];
            apply(block.n, normal, x.normal);
            // Complementarity, as far as the sweeps have come.
            const Real v = along(island, block, block.n, normal);
            CHECK(v > -1e-6);
            CHECK((x.normal == 0 || std::abs(v) < 1e-6));
            for (int j = 0; j < 2 && block.friction >= 0; ++j) {
                const FrictionRow& row = island.contacts.frictions[block.friction + 2 * i + j];
                apply(row.t, row, x.friction[j]);
                CHECK(std::abs(x.friction[j]) <= block.mu * x.normal * (1 + 1e-12));
            }
        }
    }
    CHECK(distance(sum.bodies, island.bodies) < 1e-8);
}

TEST_CASE("both kernels of a tree's contacts give the same bits") {
    const unsigned seed = GENERATE(range(1u, 5u));
    CAPTURE(seed);
    std::array<std::vector<PointImpulse>, 2> impulses;
    const std::array<const TreeKernel*, 2> kernels = {&kPortableTreeKernel, best_tree_kernel()};
    for (std::size_t k = 0; k < kernels.size(); ++k) {
        Random random(seed);
        Island island = random_forest(random);
        add_contacts(random, island);
        Rows rows(island);
        TreeContacts contacts(kernels[k]);
        const BlockRange range = island.range.contacts;
        REQUIRE(contacts.gather(rows.tree, island.contacts, range, island.range.body_begin, island.range.dynamic_end));
        contacts.build(island.contacts, range);
        rows.tree.project(nullptr, island.bodies);
        contacts.begin_velocities(island.contacts, range, island.bodies);
        for (int sweep = 0; sweep < 5; ++sweep) contacts.sweep(island.contacts, true);
        impulses[k] = island.contacts.impulse;
    }
    for (std::size_t p = 0; p < impulses[0].size(); ++p) {
        CHECK(impulses[0][p].normal == impulses[1][p].normal);
        for (int j = 0; j < 2; ++j) CHECK(impulses[0][p].friction[j] == impulses[1][p].friction[j]);
    }
}

TEST_CASE("the second derivative of a joint's error is what its rows change by") {
    const unsigned seed = GENERATE(range(1u, 6u));
    CAPTURE(seed);
    Random random(seed);
    Island island = random_forest(random);
    for_each_listed_joint(island.joints, island.range.joints, [&](auto kind, const auto& j, int) {
        constexpr JointKind K = decltype(kind)::value;
        const BodyMotion &a = island.bodies.motion[j.a], &b = island.bodies.motion[j.b];
        const BodyVelocity &u_a = island.bodies.velocity[j.a], &u_b = island.bodies.velocity[j.b];
        const auto error_at = [&](Real t) {
            return joint_error<K>(j.geometry, displaced({a.x, a.R}, u_a.v, u_a.w, t), displaced({b.x, b.R}, u_b.v, u_b.w, t));
        };
        const auto c2 = joint_curvature<K>(j.geometry, {a.x, a.R}, {b.x, b.R}, {u_a.v, u_a.w}, {u_b.v, u_b.w});
        constexpr Real t = 1e-3;  // rounding 1e-16 / t² and truncation t² |C⁗| / 12, both far below 1e-3
        const auto measured = ((error_at(t) - 2 * error_at(0) + error_at(-t)) / (t * t)).eval();
        CHECK((measured - c2).norm() < 1e-3 * (1 + c2.norm()));
    });
}
