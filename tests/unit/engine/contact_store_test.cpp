// The manifold cache alone: manifolds are written by hand or asked of the narrow phase, impulses are set as the solver would.
#include "engine/contact_store.hpp"

#include "collision/shape.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <algorithm>
#include <set>

using namespace cairn;
using namespace world_building;

namespace {

constexpr Real kRounding = 1e-12;

// Plane of body B at rest under a box of body A: vertex i of A over its foot.
Manifold four_points(const Transform& X_WA, Real half, NormalOwner owner = NormalOwner::kB) {
    Manifold m;
    m.owner = owner;
    m.count = 4;
    for (int i = 0; i < 4; ++i) {
        ManifoldPoint& p = m.points[i];
        p.core_a = X_WA * Vec3(i & 1 ? half : -half, i & 2 ? half : -half, -half);
        p.core_b = Vec3(p.core_a.x(), p.core_a.y(), 0);
        p.separation = p.core_a.z();
        p.feature = 100 + static_cast<std::uint32_t>(i);
    }
    return m;
}

Contact fresh_contact(Real size = 1) {
    Contact c;
    c.size = size;
    c.alive = true;
    return c;
}

// Impulses that tell the points apart.
void set_impulses(Contact& c) {
    for (int k = 0; k < c.manifold(0).count; ++k) {
        PointState& p = c.manifold(0).points[k];
        p.warm_position = 1 + k;
        p.warm_velocity = 0.1 * (1 + k);
        p.warm_friction = Vec3(0.5 + k, -0.25, 0);
        p.t1 = Vec3::UnitY();
    }
}

const PointState& point_of(const Contact& c, std::uint32_t feature) {
    for (int k = 0; k < c.manifold(0).count; ++k)
        if (c.manifold(0).points[k].feature == feature) return c.manifold(0).points[k];
    FAIL("no point of feature " << feature);
    return c.manifold(0).points[0];
}

Transform at(const Vec3& p, const Quat& q = Quat::Identity()) {
    return {q.toRotationMatrix(), p};
}

// As the engine marks a contact that it has just asked about.
void asked(Contact& c, const Transform& X_AB, Real margin) {
    c.fresh = false;
    c.manifold(0).X_AB_query = X_AB;
    c.query_margin = margin;
}

}  // namespace

TEST_CASE("a contact point keeps its impulses by its feature while the bodies slide") {
    Contact c = fresh_contact();
    Transform X_WA = at({0, 0, 0.5});
    Manifold m = four_points(X_WA, 0.5);
    ContactStore::replace(c, &m, 1, X_WA, {});
    set_impulses(c);
    // A long slide, and the points come in another order each time.
    for (int step = 1; step <= 50; ++step) {
        X_WA.p.x() += 0.3;
        m = four_points(X_WA, 0.5);
        std::rotate(m.points.begin(), m.points.begin() + step % 4, m.points.end());
        ContactStore::replace(c, &m, 1, X_WA, {});
    }
    REQUIRE(c.manifold(0).count == 4);
    for (int k = 0; k < 4; ++k) {
        const PointState& p = point_of(c, 100 + static_cast<std::uint32_t>(k));
        CHECK(p.warm_position == 1 + k);
        CHECK(p.warm_velocity == 0.1 * (1 + k));
        CHECK(p.warm_friction == Vec3(0.5 + k, -0.25, 0));
        CHECK(p.t1 == Vec3::UnitY());
    }
}

TEST_CASE("the friction impulse is kept in the world, however the bodies turn") {
    Contact c = fresh_contact();
    const Transform before = at({0, 0, 0.5}), after = at({0, 0, 0.5}, turn({0, 0, 1}, 1.3));
    Manifold m = four_points(before, 0.5);
    ContactStore::replace(c, &m, 1, before, {});
    set_impulses(c);
    m = four_points(after, 0.5);
    ContactStore::replace(c, &m, 1, after, {});
    for (int k = 0; k < 4; ++k) CHECK(point_of(c, 100 + static_cast<std::uint32_t>(k)).warm_friction == Vec3(0.5 + k, -0.25, 0));
}

TEST_CASE("impulses are gone when bodies have been apart") {
    Contact c = fresh_contact();
    const Transform X_WA = at({0, 0, 0.5});
    const Manifold m = four_points(X_WA, 0.5);
    ContactStore::replace(c, &m, 1, X_WA, {});
    set_impulses(c);
    SECTION("by a query without points") {
        ContactStore::replace(c, nullptr, 0, X_WA, {});
    }
    SECTION("by clear") {
        ContactStore::clear(c);
    }
    CHECK(c.manifold_count == 0);
    ContactStore::replace(c, &m, 1, X_WA, {});
    REQUIRE(c.manifold_count == 1);
    for (int k = 0; k < 4; ++k) {
        CHECK(c.manifold(0).points[k].warm_position == 0);
        CHECK(c.manifold(0).points[k].warm_velocity == 0);
        CHECK(c.manifold(0).points[k].warm_friction.isZero(0));
    }
}

TEST_CASE("after a change of faces a point takes the impulses of the nearest old one, each at most once") {
    Contact c = fresh_contact();
    const Transform X_WA = at({0, 0, 0.5});
    Manifold m = four_points(X_WA, 0.5);
    ContactStore::replace(c, &m, 1, X_WA, {});
    set_impulses(c);
    // Other features, each point a little off; the last one beyond the reach of a tenth of the size.
    for (int k = 0; k < 4; ++k) {
        m.points[k].feature = 900 + static_cast<std::uint32_t>(k);
        const Vec3 shift = k < 3 ? Vec3(0.03, 0.02, 0) : Vec3(0.15, 0, 0);
        m.points[k].core_a += shift;
        m.points[k].core_b += shift;
    }
    ContactStore::replace(c, &m, 1, X_WA, {});
    for (int k = 0; k < 3; ++k) CHECK(point_of(c, 900 + static_cast<std::uint32_t>(k)).warm_position == 1 + k);
    CHECK(point_of(c, 903).warm_position == 0);

    // Two new points beside one old: the impulse is not doubled.
    Contact d = fresh_contact();
    m = four_points(X_WA, 0.5);
    m.count = 1;
    ContactStore::replace(d, &m, 1, X_WA, {});
    d.manifold(0).points[0].warm_position = 5;
    m.count = 2;
    m.points[1] = m.points[0];
    m.points[0].feature = 901, m.points[1].feature = 902;
    m.points[1].core_a.x() += 0.01, m.points[1].core_b.x() += 0.01;
    ContactStore::replace(d, &m, 1, X_WA, {});
    CHECK(d.manifold(0).points[0].warm_position + d.manifold(0).points[1].warm_position == 5);
}

TEST_CASE("a feature that stays is matched before a nearer point of another feature") {
    Contact c = fresh_contact();
    const Transform X_WA = at({0, 0, 0.5});
    Manifold m = four_points(X_WA, 0.5);
    m.count = 2;
    ContactStore::replace(c, &m, 1, X_WA, {});
    set_impulses(c);
    // Point 0 appears as a new feature where the old point 1 was; old feature 101 has moved away.
    m.points[0].feature = 777;
    std::swap(m.points[0].core_a, m.points[1].core_a);
    std::swap(m.points[0].core_b, m.points[1].core_b);
    ContactStore::replace(c, &m, 1, X_WA, {});
    CHECK(point_of(c, 101).warm_position == 2);
}

TEST_CASE("the contact of a rolling ball keeps its impulse") {
    // The one point of a ball has a feature of its own: it stays although the material point under the centre is another one each time.
    const Shape sphere = Shape::sphere(0.5), plane = Shape::plane(Vec3::UnitZ(), 0);
    Contact c = fresh_contact();
    NarrowStats stats;
    std::vector<Manifold> found;
    for (int step = 0; step < 200; ++step) {
        const Real x = 0.05 * step;
        const Transform X_WA = at({x, 0, 0.5}, turn({0, 1, 0}, x / 0.5));
        found.clear();
        collide_shapes({&sphere, X_WA}, {&plane, {}}, 0.01, c.cache, found, stats);
        REQUIRE(found.size() == 1);
        ContactStore::replace(c, found.data(), 1, X_WA, {});
        if (step == 0) set_impulses(c);
        REQUIRE(c.manifold(0).points[0].warm_position == 1);
        REQUIRE(c.manifold(0).points[0].warm_friction == Vec3(0.5, -0.25, 0));
    }
}

TEST_CASE("a manifold is reused within a small share of the size and not beyond") {
    const Real size = GENERATE(0.01, 1.0, 50.0);
    CAPTURE(size);
    Contact c = fresh_contact(size);
    const Transform X_WA = at({0, 0, size / 2}), X_AB = at({0, 0, -size / 2});
    const Manifold m = four_points(X_WA, size / 2);
    ContactStore::replace(c, &m, 1, X_WA, {});
    CHECK_FALSE(ContactStore::is_reusable(c, Transform(), X_AB, 0));  // fresh: never asked
    asked(c, X_AB, 0.01);

    CHECK(ContactStore::is_reusable(c, Transform(), X_AB, 0.01));
    CHECK(ContactStore::is_reusable(c, Transform(), X_AB, 0.001));
    // A margin that grew might need points that were not asked for.
    CHECK_FALSE(ContactStore::is_reusable(c, Transform(), X_AB, 0.0101));

    // 2e-3 of the size, 2e-3 rad, whoever owns the normal.
    const Vec3 d = Vec3(1, -1, 1).normalized();
    for (const NormalOwner owner : {NormalOwner::kA, NormalOwner::kB, NormalOwner::kNone}) {
        CAPTURE(static_cast<int>(owner));
        c.manifold(0).owner = owner;
        CHECK(ContactStore::is_reusable(c, Transform(), at(X_AB.p + 1.9e-3 * size * d), 0.01));
        CHECK_FALSE(ContactStore::is_reusable(c, Transform(), at(X_AB.p + 2.1e-3 * size * d), 0.01));
        CHECK(ContactStore::is_reusable(c, Transform(), at(X_AB.p, turn(d, 1.9e-3)), 0.01));
        CHECK_FALSE(ContactStore::is_reusable(c, Transform(), at(X_AB.p, turn(d, 2.1e-3)), 0.01));
    }

    ContactStore::clear(c);
    CHECK_FALSE(ContactStore::is_reusable(c, Transform(), X_AB, 0.01));
}

TEST_CASE("what moved is measured where they touch, however far away the origin of a ground is") {
    const Real size = 0.2;
    Contact c = fresh_contact(size);
    const Vec3 far(100, -70, 30);
    const Transform X_WA = at(far + Vec3(0, 0, size / 2));
    Manifold m = four_points(at({0, 0, size / 2}), size / 2);
    for (int k = 0; k < m.count; ++k) m.points[k].core_a += far, m.points[k].core_b += far;
    ContactStore::replace(c, &m, 1, X_WA, {});
    const auto ground_in = [](const Transform& X) { return Transform{X.R.transpose(), -(X.R.transpose() * X.p)}; };
    asked(c, ground_in(X_WA), 0.01);
    // A turn about the body itself, by 1.5e-3 rad: the ground's origin goes 0.19 m, what touches a thousandth of that.
    const Vec3 axis = Vec3(1, 2, -1).normalized();
    CHECK(ContactStore::is_reusable(c, Transform(), ground_in(at(X_WA.p, turn(axis, 1.5e-3))), 0.01));
    CHECK_FALSE(ContactStore::is_reusable(c, Transform(), ground_in(at(X_WA.p, turn(axis, 2.5e-3))), 0.01));
    CHECK_FALSE(ContactStore::is_reusable(c, Transform(), ground_in(at(X_WA.p + Vec3(3e-3 * size, 0, 0))), 0.01));
}

TEST_CASE("a refreshed vertex over a face has its exact separation, whichever body turned") {
    const NormalOwner owner = GENERATE(NormalOwner::kA, NormalOwner::kB);
    Random r(7);
    for (int round = 0; round < 100; ++round) {
        // A's lower face z_A = −0.5 or B's upper face z_B = 0 owns the normal; the points are vertices of the other body.
        const Transform X_WA0 = at({0, 0, 0.51});
        Manifold m = four_points(X_WA0, 0.5, owner);
        Contact c = fresh_contact();
        ContactStore::replace(c, &m, 1, X_WA0, {});
        set_impulses(c);
        // Any motion of both, not only what reuse would allow.
        const Transform X_WA = at(X_WA0.p + r.vector(0.1), turn(r.vector(1), 0.2)), X_WB = at(r.vector(0.1), turn(r.vector(1), 0.2));
        ContactStore::refresh(c, X_WA, X_WB);
        const Vec3 n = owner == NormalOwner::kA ? X_WA.R.col(2) : X_WB.R.col(2);
        CHECK((c.manifold(0).n - n).norm() < kRounding);
        for (int k = 0; k < 4; ++k) {
            const PointState& p = point_of(c, 100 + static_cast<std::uint32_t>(k));
            const Vec3 corner(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, 0);
            const Real truth = owner == NormalOwner::kB ? X_WB.to_local(X_WA * Vec3(corner.x(), corner.y(), -0.5)).z()
                                                        : -(X_WA.to_local(X_WB * corner).z() + 0.5);
            CHECK(std::abs(p.separation - truth) < kRounding);
            CHECK(p.warm_position == 1 + k);
            // The surface points lie on a common normal, the separation apart, the vertex itself being one of them.
            const SurfacePoints s = surface_points(c.manifold(0), p, X_WA, X_WB);
            CHECK((s.p_a - s.p_b - truth * n).norm() < kRounding);
        }
    }
}

TEST_CASE("the separation of a refreshed round point does not see the ball turn") {
    Contact c = fresh_contact();
    Manifold m;
    m.owner = NormalOwner::kB;
    m.count = 1;
    m.points[0].core_a = {0, 0, 0.5};
    m.points[0].radius_a = 0.5;
    m.points[0].separation = 0;
    const Transform X_WA = at({0, 0, 0.5});
    ContactStore::replace(c, &m, 1, X_WA, {});
    const Real angle = GENERATE(0.1, 1.0, 3.0);
    const Transform moved = at({0.3, 0, 0.52}, turn({0.2, 1, 0.3}, angle));
    ContactStore::refresh(c, moved, {});
    CHECK(std::abs(c.manifold(0).points[0].separation - 0.02) < kRounding);
    const SurfacePoints s = surface_points(c.manifold(0), c.manifold(0).points[0], moved, {});
    CHECK((s.p_a - Vec3(0.3, 0, 0.02)).norm() < kRounding);
    CHECK((s.p_b - Vec3(0.3, 0, 0)).norm() < kRounding);
}

TEST_CASE("each manifold of a mesh takes the impulses of its own cluster") {
    Contact c = fresh_contact();
    const Transform X_WA = at({0, 0, 0.5});
    Manifold two[2] = {four_points(X_WA, 0.5), four_points(X_WA, 0.5)};
    two[0].sub_key = 11;
    two[1].sub_key = 22;
    two[1].n = Vec3::UnitX();
    ContactStore::replace(c, two, 2, X_WA, {});
    c.manifold(0).points[0].warm_position = 3;
    c.manifold(1).points[0].warm_position = 4;
    std::swap(two[0], two[1]);
    ContactStore::replace(c, two, 2, X_WA, {});
    CHECK(c.manifold(0).points[0].warm_position == 4);
    CHECK(c.manifold(1).points[0].warm_position == 3);
    // One of two goes: the other keeps its own.
    ContactStore::replace(c, &two[1], 1, X_WA, {});
    REQUIRE(c.manifold_count == 1);
    CHECK(c.manifold(0).points[0].warm_position == 3);
}

TEST_CASE("slots of ended contacts are reused, and the pair is found in either order") {
    ContactStore store;
    const auto add = [&](std::uint32_t a, std::uint32_t b) {
        Contact c;
        c.shape_a = a;
        c.shape_b = b;
        return store.add(c);
    };
    const std::uint32_t first = add(1, 2);
    add(3, 4);
    CHECK(store.find(1, 2) == first);
    CHECK(store.find(2, 1) == first);
    CHECK(store.find(1, 4) == PairMap::kNone);
    store.remove(2, 1);
    store.remove(2, 1);  // a second time does nothing
    CHECK(store.find(1, 2) == PairMap::kNone);
    CHECK_FALSE(store.slots()[first].alive);
    CHECK(store.size() == 1);
    CHECK(add(9, 8) == first);
    CHECK(store.slots()[first].fresh);
    CHECK(store.slots()[first].manifold_count == 0);

    std::set<std::uint32_t> used;
    for (int round = 0; round < 1000; ++round) {
        for (std::uint32_t k = 0; k < 10; ++k) used.insert(add(100 + k, 200 + k));
        for (std::uint32_t k = 0; k < 10; ++k) store.remove(100 + k, 200 + k);
    }
    CHECK(used.size() == 10);
    CHECK(store.slots().size() == 12);
}
