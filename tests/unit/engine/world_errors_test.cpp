// What a world refuses: each bad value by its name, and nothing has changed afterwards.
#include "engine/base/error.hpp"
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <cmath>
#include <functional>
#include <limits>

using namespace cairn;
using namespace world_building;

namespace {

constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
constexpr Real kInf = std::numeric_limits<Real>::infinity();

template <typename Def>
struct Mistake {
    std::string named;  // in the message
    std::function<void(Def&)> make;
};

// A world in the middle of something: contacts, a joint, forces.
struct Scene {
    World world;
    BodyId floor, lower, upper;
    JointId joint;
    Scene() {
        floor = world.add_body(ground());
        lower = world.add_body(cube(1, {0, 0, 0.5}));
        upper = world.add_body(cube(1, {0, 0, 1.5}));
        joint = world.add_joint({JointType::kHinge, lower, upper, {0.5, 0, 1}});
        run(world, 0.1);
    }
};

template <typename Act>
void refuses(World& world, const std::string& named, Act act) {
    CAPTURE(named);
    const std::uint64_t hash = world.hash();
    const std::size_t bodies = world.body_count(), joints = world.joint_count();
    std::string message;
    try {
        act();
    } catch (const Error& e) {
        message = e.what();
    }
    CHECK_THAT(message, Catch::Contains(named));
    CHECK(world.hash() == hash);
    CHECK(world.body_count() == bodies);
    CHECK(world.joint_count() == joints);
}

}  // namespace

TEST_CASE("a world refuses a body with a bad value, names it and stays as it was") {
    const std::vector<Mistake<BodyDef>> mistakes = {
        {"position", [](BodyDef& d) { d.position.y() = kNan; }},
        {"position", [](BodyDef& d) { d.position.z() = kInf; }},
        {"linear_velocity", [](BodyDef& d) { d.linear_velocity.x() = -kInf; }},
        {"angular_velocity", [](BodyDef& d) { d.angular_velocity.x() = kNan; }},
        {"force", [](BodyDef& d) { d.force.z() = kNan; }},
        {"torque", [](BodyDef& d) { d.torque.z() = kInf; }},
        {"rotation", [](BodyDef& d) { d.rotation = Quat(0, 0, 0, 0); }},
        {"rotation", [](BodyDef& d) { d.rotation = Quat(1, kNan, 0, 0); }},
        {"mass", [](BodyDef& d) { d.mass = 0; }},
        {"mass", [](BodyDef& d) { d.mass = -1; }},
        {"mass", [](BodyDef& d) { d.mass = kNan; }},
        {"mass", [](BodyDef& d) { d.mass = kInf; }},
        {"friction", [](BodyDef& d) { d.friction = -0.1; }},
        {"friction", [](BodyDef& d) { d.friction = kNan; }},
        {"restitution", [](BodyDef& d) { d.restitution = -0.1; }},
        {"restitution", [](BodyDef& d) { d.restitution = kInf; }},
        {"torsional_friction", [](BodyDef& d) { d.torsional_friction = -1; }},
        {"rolling_friction", [](BodyDef& d) { d.rolling_friction = kNan; }},
        {"inertia[1]", [](BodyDef& d) { d.inertia = Vec3(1, 0, 1); }},
        {"inertia[2]", [](BodyDef& d) { d.inertia = Vec3(1, 1, kNan); }},
        {"inertia[0]", [](BodyDef& d) { d.inertia = Vec3(3, 1, 1); }},  // no solid has I₁ > I₂ + I₃
        {"inertia", [](BodyDef& d) { d.shapes.clear(); }},
        {"centroid",
         [](BodyDef& d) {
             d.shapes = {Shape::sphere(0.5, {Quat::Identity(), {0.1, 0, 0}})};
         }},
        {"shapes[0]", [](BodyDef& d) { d.shapes = {Shape::plane(Vec3::UnitZ(), 0)}; }},
        {"shapes[1]",
         [](BodyDef& d) {
             d.shapes.push_back(Shape::triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}));
         }},
        {"motion", [](BodyDef& d) { d.motion = RotateSine{}; }},
        {"motion.axis",
         [](BodyDef& d) {
             d.type = BodyType::kKinematic, d.motion = RotateSine{Vec3::Zero(), 1, 1, 0};
         }},
        {"motion.period",
         [](BodyDef& d) {
             d.type = BodyType::kKinematic, d.motion = RotateSine{Vec3::UnitZ(), 1, 0, 0};
         }},
        {"motion.amplitude",
         [](BodyDef& d) {
             d.type = BodyType::kKinematic, d.motion = RotateSine{Vec3::UnitZ(), kNan, 1, 0};
         }},
        {"motion.phase",
         [](BodyDef& d) {
             d.type = BodyType::kKinematic, d.motion = RotateSine{Vec3::UnitZ(), 1, 1, kInf};
         }},
    };
    Scene s;
    for (const Mistake<BodyDef>& m : mistakes) {
        BodyDef def = cube(1, {5, 0, 0.5});
        def.name = "crate";
        m.make(def);
        refuses(s.world, m.named, [&] { s.world.add_body(def); });
        refuses(s.world, "crate", [&] { s.world.add_body(def); });
    }
}

TEST_CASE("a world refuses a joint with a bad value, names it and stays as it was") {
    Scene s;
    const BodyId other = s.world.add_body(cube(1, {5, 0, 0.5}));
    const BodyId gone = s.world.add_body(cube(1, {9, 0, 0.5}));
    s.world.remove_body(gone);
    const std::vector<Mistake<JointDef>> mistakes = {
        {"anchor_a", [](JointDef& d) { d.anchor_a.x() = kNan; }},
        {"anchor_b", [](JointDef& d) { d.type = JointType::kDistance, d.anchor_b.x() = kInf; }},
        {"anchor_a", [](JointDef& d) { d.anchor_a.x() = 1e308; }},
        {"anchor_a", [](JointDef& d) { d.type = JointType::kBall, d.anchor_a.z() = 1.1e6; }},
        {"distance", [](JointDef& d) { d.type = JointType::kDistance, d.anchor_b.y() = -1e308; }},
        {"anchor_b", [](JointDef& d) { d.type = JointType::kDistance, d.anchor_a.y() = 9e5, d.anchor_b.y() = 1.1e6; }},
        {"distance", [](JointDef& d) { d.type = JointType::kDistance, d.anchor_b = d.anchor_a; }},
        {"axis", [](JointDef& d) { d.axis.setZero(); }},
        {"axis", [](JointDef& d) { d.type = JointType::kSlider, d.axis.y() = kNan; }},
        {"itself", [](JointDef& d) { d.body_b = d.body_a; }},
        {"itself", [](JointDef& d) { d.body_a = d.body_b = BodyId{}; }},
        {"dynamic", [&](JointDef& d) { d.body_a = s.floor, d.body_b = BodyId{}; }},
        {"stale", [&](JointDef& d) { d.body_a = gone; }},
        {"stale",
         [&](JointDef& d) {
             d.body_b = BodyId{1000, 0};
         }},
    };
    for (const Mistake<JointDef>& m : mistakes) {
        JointDef def{JointType::kHinge, s.upper, other, {2, 0, 1}};
        m.make(def);
        refuses(s.world, m.named, [&] { s.world.add_joint(def); });
    }
}

TEST_CASE("a world refuses bad settings and names them") {
    const std::vector<Mistake<WorldSettings>> mistakes = {
        {"gravity", [](WorldSettings& s) { s.gravity.x() = kNan; }},
        {"gravity", [](WorldSettings& s) { s.gravity.z() = kInf; }},
        {"substeps", [](WorldSettings& s) { s.substeps = 0; }},
        {"iterations", [](WorldSettings& s) { s.iterations = 0; }},
        {"iterations", [](WorldSettings& s) { s.iterations = -3; }},
        {"threads", [](WorldSettings& s) { s.threads = 0; }},
        {"residual_tolerance", [](WorldSettings& s) { s.residual_tolerance = -1e-9; }},
        {"residual_tolerance", [](WorldSettings& s) { s.residual_tolerance = kNan; }},
    };
    for (const Mistake<WorldSettings>& m : mistakes) {
        CAPTURE(m.named);
        WorldSettings settings;
        m.make(settings);
        CHECK_THROWS_WITH(World(settings), Catch::Contains(m.named));
    }
    Scene s;
    refuses(s.world, "gravity", [&] { s.world.set_gravity({0, kNan, 0}); });
}

TEST_CASE("a handle of a removed body, of a removed joint or of another world is refused") {
    Scene s;
    const BodyId gone = s.world.add_body(cube(1, {5, 0, 0.5}));
    s.world.remove_body(gone);
    const BodyId heir = s.world.add_body(cube(1, {5, 0, 0.5}));  // in the same place
    REQUIRE(heir.index == gone.index);
    REQUIRE_FALSE(heir == gone);
    for (const BodyId& id : {gone, BodyId{77, 0}}) {
        refuses(s.world, "stale", [&] { s.world.state(id); });
        refuses(s.world, "stale", [&] { s.world.set_state(id, {}); });
        refuses(s.world, "stale", [&] { s.world.set_force(id, {}, {}); });
        refuses(s.world, "stale", [&] { s.world.apply_impulse(id, {}, {}); });
        refuses(s.world, "stale", [&] { s.world.type(id); });
        refuses(s.world, "stale", [&] { s.world.mass(id); });
        refuses(s.world, "stale", [&] { s.world.inertia(id); });
        refuses(s.world, "stale", [&] { s.world.name(id); });
        refuses(s.world, "stale", [&] { s.world.is_sleeping(id); });
        refuses(s.world, "stale", [&] { s.world.is_enabled(id); });
        refuses(s.world, "stale", [&] { s.world.wake(id); });
        refuses(s.world, "stale", [&] { s.world.remove_body(id); });
    }
    refuses(s.world, "body handle", [&] { s.world.state(BodyId{}); });
    s.world.remove_joint(s.joint);
    refuses(s.world, "stale", [&] { s.world.joint_error(s.joint); });
    refuses(s.world, "stale", [&] { s.world.remove_joint(s.joint); });
    const JointId next = s.world.add_joint({JointType::kBall, s.lower, s.upper, {0, 0, 1}});
    CHECK(next.index == s.joint.index);
    refuses(s.world, "stale", [&] { s.world.joint_error(s.joint); });
    s.world.remove_body(s.upper);  // takes its joint along
    refuses(s.world, "stale", [&] { s.world.joint_error(next); });
}

TEST_CASE("states, forces and impulses that are not finite are refused") {
    Scene s;
    const BodyState good = s.world.state(s.upper);
    BodyState bad = good;
    bad.position.x() = kNan;
    refuses(s.world, "state", [&] { s.world.set_state(s.upper, bad); });
    bad = good;
    bad.rotation = Quat(0, 0, 0, 0);
    refuses(s.world, "rotation", [&] { s.world.set_state(s.upper, bad); });
    bad = good;
    bad.angular_velocity.y() = kInf;
    refuses(s.world, "state", [&] { s.world.set_state(s.upper, bad); });
    refuses(s.world, "plane", [&] { s.world.set_state(s.floor, good); });
    refuses(s.world, "force", [&] { s.world.set_force(s.upper, {0, 0, kNan}, Vec3::Zero()); });
    refuses(s.world, "force", [&] { s.world.set_force(s.upper, Vec3::Zero(), {0, 0, kInf}); });
    refuses(s.world, "dynamic", [&] { s.world.set_force(s.floor, Vec3::Zero(), Vec3::Zero()); });
    refuses(s.world, "impulse", [&] { s.world.apply_impulse(s.upper, {kNan, 0, 0}, Vec3::Zero()); });
    refuses(s.world, "dynamic", [&] { s.world.apply_impulse(s.floor, Vec3::Zero(), Vec3::Zero()); });
}

TEST_CASE("a step whose length is not finite and positive changes nothing and says so") {
    Scene s;
    const std::uint64_t hash = s.world.hash();
    const Real time = s.world.time();
    // The last ones are so short that what they take back of a penetration would leave rounding errors larger than any motion.
    for (Real dt : {0.0, -0.0, -1.0 / 60, kNan, kInf, -kInf, 5e-324, 1e-310, 1e-100, 0.99 * s.world.settings().substeps * kLeastSubstep}) {
        CAPTURE(dt);
        CHECK_FALSE(s.world.step(dt).ok);
        CHECK(s.world.hash() == hash);
        CHECK(s.world.time() == time);
    }
    CHECK(s.world.step(kStep).ok);
}

TEST_CASE("the shortest step is a step, and bodies at rest stay so in it and after it") {
    World world;
    world.add_body(ground());
    const BodyId lower = world.add_body(cube(1, {0, 0, 0.5})), upper = world.add_body(cube(1, {0, 0, 1.5}));
    const BodyId arm = world.add_body(cube(1, {5, 0, 5}));
    world.add_joint({JointType::kHinge, arm, BodyId{}, {5, 0, 5.5}, Vec3::Zero(), {0, 1, 0}});
    run(world, 2);
    for (int k = 0; k < 3; ++k) REQUIRE(world.step(world.settings().substeps * kLeastSubstep).ok);
    run(world, 0.1);
    // Impulses of a step so short say nothing of the next one, which starts without any: 2 cm/s and less for a few steps, a millimetre.
    for (const BodyId id : {lower, upper, arm}) CHECK(world.state(id).linear_velocity.norm() < 0.02);
    CHECK(std::abs(world.state(upper).position.z() - 1.5) < 1e-3);
    CHECK((world.state(arm).position - Vec3(5, 0, 5)).norm() < 1e-3);
}

TEST_CASE("the hash is over forces, torques and what was taken out as well") {
    const auto hash_after = [](auto act) {
        Scene s;
        act(s);
        return s.world.hash();
    };
    const std::uint64_t plain = hash_after([](Scene&) {});
    CHECK(hash_after([](Scene&) {}) == plain);
    CHECK(hash_after([](Scene& s) { s.world.set_force(s.upper, {1, 0, 0}, Vec3::Zero()); }) != plain);
    CHECK(hash_after([](Scene& s) { s.world.set_force(s.upper, Vec3::Zero(), {0, 0, 1}); }) != plain);
    CHECK(hash_after([](Scene& s) { s.world.set_gravity({0, 0, -9.8}); }) != plain);
    CHECK(hash_after([](Scene& s) { s.world.remove_joint(s.joint); }) != plain);
    CHECK(hash_after([](Scene& s) { s.world.add_body(cube(1, {5, 5, 5})); }) != plain);
}
