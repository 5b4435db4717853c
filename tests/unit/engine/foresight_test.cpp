// Which pairs are looked at twice, and what becomes of the second look.
#include "engine/foresight.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <algorithm>
#include <random>

using namespace cairn;
using namespace world_building;

namespace {

constexpr Real kRounding = 1e-12;
constexpr Real kSize = 0.5;  // [m]

Body mover(const Vec3& position, const Vec3& v, const Vec3& w = Vec3::Zero()) {
    Body b;
    b.type = BodyType::kDynamic;
    b.X_WB.p = position;
    b.v = v;
    b.w = w;
    return b;
}

// One point between a body above (A) and one below, `gap` apart.
std::vector<Manifold> one_point(Real gap, NormalOwner owner = NormalOwner::kB, std::uint32_t feature = 7) {
    Manifold m;
    m.owner = owner;
    m.count = 1;
    m.points[0].core_b = Vec3::Zero();
    m.points[0].core_a = Vec3(0, 0, gap);
    m.points[0].separation = gap;
    m.points[0].feature = feature;
    return {m};
}

Foresight foresee(const Body& a, const Body& b, bool has_ball, const std::vector<Manifold>& found, Real size, Real dt) {
    return foresight_of(a, b, {a.w - b.w, has_ball}, found, size, dt);
}

const Body kTable = mover({0, 0, -1}, Vec3::Zero());

}  // namespace

TEST_CASE("a pair that will meet within the step is foreseen for when it meets") {
    const Body falling = mover({0, 0, 0.3}, {0, 0, -6});
    const Foresight f = foresee(falling, kTable, false, one_point(0.05), kSize, kStep);
    CHECK(f.meeting == Approx(0.05 / 6));
    CHECK_FALSE(f.at_end);
    CHECK(foresee(falling, kTable, true, one_point(0.05), kSize, kStep).meeting == f.meeting);  // balls as well
}

TEST_CASE("the point that a turning body closes first says when a pair meets") {
    // 4 rad/s about y take a point at x = 0.2 down by 0.8 m/s, and its mirror image up.
    const Body turning = mover({0, 0, 0.1}, {0, 0, -1}, {0, 4, 0});
    std::vector<Manifold> found = one_point(0.02);
    found[0].count = 2;
    found[0].points[1] = found[0].points[0];
    found[0].points[0].core_a.x() = found[0].points[0].core_b.x() = 0.2;
    found[0].points[1].core_a.x() = found[0].points[1].core_b.x() = -0.2;
    CHECK(foresee(turning, kTable, false, found, kSize, kStep).meeting == Approx(0.02 / 1.8));
}

TEST_CASE("a pair that does not meet within the step, or has hardly to go, is looked at once") {
    const auto looks_twice = [](const Vec3& v, const std::vector<Manifold>& found) {
        const Foresight f = foresee(mover({0, 0, 0.3}, v), kTable, false, found, kSize, kStep);
        return f.meeting > 0 || f.at_end;
    };
    CHECK_FALSE(looks_twice({0, 0, -2}, one_point(0.05)));
    CHECK_FALSE(looks_twice({0, 0, 6}, one_point(0.05)));
    CHECK_FALSE(looks_twice({0, 0, -6}, one_point(0.001)));
    CHECK_FALSE(looks_twice({0, 0, -6}, {}));
    CHECK_FALSE(looks_twice({0, 0, -6}, one_point(0.05, NormalOwner::kCores)));
}

TEST_CASE("a pair that touches is foreseen for the step's end if it turns, unless one of it is a ball") {
    const Body turning = mover({0, 0, 0.3}, Vec3::Zero(), {0, 3, 0}), resting = mover({0, 0, 0.3}, Vec3::Zero());
    const Foresight f = foresee(turning, kTable, false, one_point(0), kSize, kStep);
    CHECK(f.meeting == 0);
    CHECK(f.at_end);
    CHECK_FALSE(foresee(turning, kTable, true, one_point(0), kSize, kStep).at_end);
    CHECK_FALSE(foresee(resting, kTable, false, one_point(-1e-4), kSize, kStep).at_end);
}

TEST_CASE("a capsule that turns about its own axis brings no other features, and is not foreseen for it") {
    ShapeRecord capsule, ground;
    capsule.shape = Shape::capsule(0.2, 0.3);
    capsule.X_BS.R = Mat3(Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitX()));  // its axis along the body's x
    ground.shape = Shape::box(Vec3(1, 1, 1));
    Body body = mover({0, 0, 0.3}, Vec3::Zero(), {5, 0.25, 0});
    CHECK((turning_of(body, capsule, kTable, ground).rate - Vec3(0, 0.25, 0)).norm() < kRounding);
    CHECK((turning_of(kTable, ground, body, capsule).rate - Vec3(0, -0.25, 0)).norm() < kRounding);
    capsule.X_BS.p = Vec3(0, 0, 0.1);  // off its body's centre the turn moves it
    CHECK((turning_of(body, capsule, kTable, ground).rate - body.w).norm() < kRounding);
    CHECK_FALSE(turning_of(body, capsule, kTable, ground).has_ball);
}

namespace {

ShapeRecord record_of(const Shape& shape) {
    ShapeRecord record;
    record.shape = shape;
    record.size = kSize;
    return record;
}

// A bar of 1 m along x that touches a box below it with the lower edge of its end at +x, leaning by `lean` about y.
struct LeaningBar {
    ShapeRecord shape = record_of(Shape::box({0.5, 0.05, 0.05})), ground = record_of(Shape::box({2, 2, 1}));
    Body body = mover(Vec3::Zero(), Vec3::Zero());
    std::vector<Manifold> found;

    explicit LeaningBar(Real lean) {
        body.X_WB.q = turn(Vec3::UnitY(), lean);
        body.R = body.X_WB.q.toRotationMatrix();
        found = one_point(0);
        found[0].count = 2;
        body.X_WB.p.z() = -(body.R * Vec3(0.5, 0, -0.05)).z();
        for (int i = 0; i < 2; ++i) {
            ManifoldPoint& p = found[0].points[i];
            p = found[0].points[0];
            p.core_a = body.X_WB.p + body.R * Vec3(0.5, i == 0 ? 0.05 : -0.05, -0.05);
            p.core_b = {p.core_a.x(), p.core_a.y(), 0};
        }
    }
    // Turning by `turned` about its lowest edge within the step.
    bool looks_again(Real turned, bool as_b = false) {
        body.w = {0, turned / kStep, 0};
        body.v = body.w.cross(body.X_WB.p - found[0].points[0].core_a);
        if (!as_b) return may_come_down(body, shape, kTable, ground, {body.w, false}, found, kStep);
        std::vector<Manifold> other = found;
        other[0].owner = NormalOwner::kA;
        other[0].n = -other[0].n;
        for (int i = 0; i < 2; ++i) std::swap(other[0].points[i].core_a, other[0].points[i].core_b);
        return may_come_down(kTable, ground, body, shape, {-body.w, false}, other, kStep);
    }
};

}  // namespace

TEST_CASE("a bar that turns about the edge that it lies on is looked at again if its other end comes down in the step") {
    const bool as_b = GENERATE(false, true);
    LeaningBar bar(0.1);
    CHECK_FALSE(bar.looks_again(-0.09, as_b));  // 1 cm is left below the other end
    CHECK(bar.looks_again(-0.11, as_b));
    CHECK_FALSE(bar.looks_again(0.2, as_b));  // it rises
}

TEST_CASE("capsules are looked at again if their axes may come side by side in the step, edges always") {
    ShapeRecord a = record_of(Shape::capsule(0.1, 0.4)), b = a, box = record_of(Shape::box({1, 1, 1}));
    a.X_BS.R = turn(Vec3::UnitY(), 0.3).toRotationMatrix();
    Body moving = mover({0, 0, 0.1}, Vec3::Zero());
    const std::vector<Manifold> found = one_point(0, NormalOwner::kNone);
    const auto looks_again = [&](Real turned, const ShapeRecord& other) {
        moving.w = {0, turned / kStep, 0};
        return may_come_down(moving, a, kTable, other, {moving.w, false}, found, kStep);
    };
    CHECK_FALSE(looks_again(0.2, b));
    CHECK(looks_again(0.3, b));
    CHECK(looks_again(0.02, box));
}

TEST_CASE("a pair whose nearest points part is foreseen for the step's end if turning may bring others down") {
    const Body rising = mover({0, 0, 0.3}, {0, 0, 1}, {0, 14, 0});
    const Real turned = 14 * kStep * kSize;  // [m]
    CHECK(foresee(rising, kTable, false, one_point(0.9 * turned), kSize, kStep).at_end);
    CHECK_FALSE(foresee(rising, kTable, false, one_point(1.1 * turned), kSize, kStep).at_end);
}

TEST_CASE("a pair that turns and comes from afar is foreseen for when it meets and for the step's end") {
    const Foresight f = foresee(mover({0, 0, 0.3}, {0, 0, -12}, {0, 3, 0}), kTable, false, one_point(0.1), kSize, kStep);
    CHECK(f.meeting == Approx(0.1 / 12));
    CHECK(f.at_end);
}

TEST_CASE("what is foreseen is brought back with the bodies that it lies on") {
    const Body a = mover({0.1, 0.2, 0.4}, {1, 0, -2}, {0.5, 3, -1}), b = mover({0, 0, -1}, {0, 0.3, 0}, {0, 0, 2});
    const Transform X_WA{Mat3::Identity(), a.X_WB.p}, X_WB{Mat3::Identity(), b.X_WB.p};
    const Transform Y_WA = pose_after(a, kStep), Y_WB = pose_after(b, kStep);
    CHECK((Y_WA.p - (a.X_WB.p + kStep * a.v)).norm() < kRounding);
    CHECK((Y_WA.R - exp_rotation(kStep * a.w).toRotationMatrix()).norm() < kRounding);
    const NormalOwner owner = GENERATE(NormalOwner::kA, NormalOwner::kB, NormalOwner::kNone);
    std::vector<Manifold> foreseen = one_point(0.01, owner);
    const Manifold then = foreseen[0];
    bring_back(foreseen, X_WA, X_WB, Y_WA, Y_WB);
    const Manifold& now = foreseen[0];
    CHECK((X_WA.to_local(now.points[0].core_a) - Y_WA.to_local(then.points[0].core_a)).norm() < kRounding);
    CHECK((X_WB.to_local(now.points[0].core_b) - Y_WB.to_local(then.points[0].core_b)).norm() < kRounding);
    const Transform &X = owner == NormalOwner::kA ? X_WA : X_WB, &Y = owner == NormalOwner::kA ? Y_WA : Y_WB;
    const Vec3 n = owner == NormalOwner::kNone ? then.n : Vec3(X.R * Y.R.transpose() * then.n);
    CHECK((now.n - n).norm() < kRounding);
    CHECK(now.points[0].separation == Approx(n.dot(now.points[0].core_a - now.points[0].core_b)));
}

TEST_CASE("of what is foreseen for a pair that touches, new features are added that are clear at the start") {
    std::vector<Manifold> found = one_point(-1e-5);
    std::vector<Manifold> foreseen = one_point(0.01);
    foreseen[0].count = 3;
    foreseen[0].points[1] = foreseen[0].points[2] = foreseen[0].points[0];  // feature 7 is there already
    foreseen[0].points[1].feature = 8;
    foreseen[0].points[2].feature = 9;
    foreseen[0].points[2].separation = -0.002;  // overlaps now, and yet was not found
    add_foreseen(found, foreseen);
    REQUIRE(found.size() == 2);
    CHECK(found[1].count == 1);
    CHECK(found[1].points[0].feature == 8);
    CHECK(found[1].sub_key == (found[0].sub_key ^ kForeseen));

    std::vector<Manifold> same = one_point(-1e-5);
    add_foreseen(same, one_point(0.01));
    CHECK(same.size() == 1);
}

TEST_CASE("boxes that meet as they tumble hardly sink into each other") {
    // Corners at up to 7 m/s, so up to 0.1 m in a step. Without foresight the median of these is 3.8 mm, with it 1.7 mm.
    constexpr int kPairs = 200;
    constexpr Real kMedian = 2.7e-3;  // [m]
    std::mt19937 random(3);
    std::uniform_real_distribution<Real> uniform(-1, 1);
    const auto thrown = [&](Real x, Real v) {
        BodyDef b = body(Shape::box({0.2, 0.25, 0.3}), {x, 0.15 * uniform(random), 0.15 * uniform(random)});
        b.rotation = turn(Vec3(uniform(random), uniform(random), uniform(random)), kPi * uniform(random));
        b.linear_velocity = {v, 0, 0};
        b.angular_velocity = 8 * Vec3(uniform(random), uniform(random), uniform(random));
        return b;
    };
    std::vector<Real> deepest;
    for (int k = 0; k < kPairs; ++k) {
        World world(no_gravity());
        world.add_body(thrown(-0.8, 2.5));
        world.add_body(thrown(0.8, -2.5));
        Real most = 0;
        run(world, 0.6, kStep, [&](const StepReport& r) { most = std::max(most, r.max_penetration); });
        deepest.push_back(most);
    }
    std::nth_element(deepest.begin(), deepest.begin() + kPairs / 2, deepest.end());
    CHECK(deepest[kPairs / 2] < kMedian);
}
