// What a right file gives: every key, every default.
#include "collision/hull.hpp"
#include "collision/mesh.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/files/scene_text.hpp"

#include <cmath>

using namespace cairn;
using namespace scene_text;

TEST_CASE("the head of a scene is read as it stands") {
    const Scene s = parse(R"({"format": "scene/1", "name": "n", "description": "d", "gravity": [1, -2, 3.5], "duration": 2.5,
                              "sample_interval": 0.25, "bodies": [], "joints": [], "checks": [{"metric": "rest", "whatever": [1, {}]}]})");
    CHECK(s.name == "n");
    CHECK(s.description == "d");
    CHECK(s.gravity == Vec3(1, -2, 3.5));
    CHECK(s.duration == 2.5);
    CHECK(s.sample_interval == 0.25);
    CHECK(s.bodies.empty());
    CHECK(s.joints.empty());
}

TEST_CASE("what a scene leaves out has the format's defaults") {
    const Scene s = parse(scene(ball("b")));
    CHECK(s.description.empty());
    CHECK(s.gravity == Vec3(0, 0, -9.81));
    REQUIRE(s.bodies.size() == 1);
    const BodyDef& b = s.bodies[0];
    CHECK(b.name == "b");
    CHECK(b.type == BodyType::kDynamic);
    CHECK(b.mass == 1);
    CHECK(b.rotation.coeffs() == Quat::Identity().coeffs());
    CHECK(b.linear_velocity.isZero(0));
    CHECK(b.angular_velocity.isZero(0));
    CHECK_FALSE(b.inertia.has_value());
    CHECK(b.friction == 0.5);
    CHECK(b.restitution == 0);
    CHECK(b.torsional_friction == 0);
    CHECK(b.rolling_friction == 0);
    CHECK(b.force.isZero(0));
    CHECK(b.torque.isZero(0));
    CHECK_FALSE(b.motion.has_value());
    REQUIRE(b.shapes.size() == 1);
    CHECK(b.shapes[0].X_BS.p.isZero(0));
    CHECK(b.shapes[0].X_BS.q.coeffs() == Quat::Identity().coeffs());
}

TEST_CASE("a scene without joints and checks keys is whole") {
    const Scene s = parse(R"({"format": "scene/1", "name": "s", "duration": 1, "sample_interval": 1, "bodies": []})");
    CHECK(s.joints.empty());
}

TEST_CASE("every key of a dynamic body is read") {
    const Scene s = parse(scene(ball("b", R"("rotation": [0, 0, 1, 0], "linear_velocity": [1, 2, 3], "angular_velocity": [4, 5, 6],
        "inertia": [2, 3, 4], "friction": 0.25, "restitution": 0.75, "torsional_friction": 0.01, "rolling_friction": 0.02,
        "force": [7, 8, 9], "torque": [10, 11, 12])")));
    const BodyDef& b = s.bodies.at(0);
    CHECK(b.rotation.coeffs() == Quat(0, 0, 1, 0).coeffs());
    CHECK(b.linear_velocity == Vec3(1, 2, 3));
    CHECK(b.angular_velocity == Vec3(4, 5, 6));
    REQUIRE(b.inertia.has_value());
    CHECK(*b.inertia == Vec3(2, 3, 4));
    CHECK(b.friction == 0.25);
    CHECK(b.restitution == 0.75);
    CHECK(b.torsional_friction == 0.01);
    CHECK(b.rolling_friction == 0.02);
    CHECK(b.force == Vec3(7, 8, 9));
    CHECK(b.torque == Vec3(10, 11, 12));
}

TEST_CASE("a kinematic body keeps its motion with the axis made a unit vector") {
    const Scene s = parse(scene(R"({"name": "k", "type": "kinematic", "position": [1, 2, 3], "shapes": [], "motion":
        {"type": "rotate_sine", "axis": [0, 3, 4], "amplitude": 0.5, "period": 2, "phase": 0.25}})"));
    const BodyDef& b = s.bodies.at(0);
    CHECK(b.type == BodyType::kKinematic);
    CHECK(b.position == Vec3(1, 2, 3));
    REQUIRE(b.motion.has_value());
    CHECK((b.motion->axis - Vec3(0, 0.6, 0.8)).norm() < 1e-15);  // two roundings of numbers below 1
    CHECK(b.motion->amplitude == 0.5);
    CHECK(b.motion->period == 2);
    CHECK(b.motion->phase == 0.25);
}

TEST_CASE("every shape is read with its own numbers and its pose") {
    const std::string pose = R"(, "position": [1, 2, 3], "rotation": [0.6, 0.8, 0, 0]})";
    const Scene s = parse(scene(fixed(R"({"type": "box", "half_extents": [1, 2, 3])" + pose + R"(, {"type": "sphere", "radius": 4)" + pose +
                                      R"(, {"type": "capsule", "radius": 5, "half_height": 6)" + pose +
                                      R"(, {"type": "cylinder", "radius": 7, "half_height": 8)" + pose +
                                      R"(, {"type": "convex", "points": [[0,0,0],[1,0,0],[0,1,0],[0,0,1],[0.1,0.1,0.1]])" + pose +
                                      R"(, {"type": "plane", "normal": [0, 0.6, 0.8], "offset": -2})" +
                                      R"(, {"type": "mesh", "vertices": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]])" + pose)));
    const std::vector<Shape>& h = s.bodies.at(0).shapes;
    REQUIRE(h.size() == 7);
    CHECK(h[0].type == ShapeType::kBox);
    CHECK(h[0].half_extents == Vec3(1, 2, 3));
    CHECK(h[1].type == ShapeType::kSphere);
    CHECK(h[1].radius == 4);
    CHECK(h[2].type == ShapeType::kCapsule);
    CHECK(h[2].radius == 5);
    CHECK(h[2].half_height == 6);
    CHECK(h[3].type == ShapeType::kCylinder);
    CHECK(h[3].radius == 7);
    CHECK(h[3].half_height == 8);
    CHECK(h[4].type == ShapeType::kHull);
    REQUIRE(h[4].hull);
    CHECK(h[4].hull->vertices().size() == 4);  // the fifth point lies inside
    CHECK(h[5].type == ShapeType::kPlane);
    CHECK((h[5].normal - Vec3(0, 0.6, 0.8)).norm() < 1e-15);
    CHECK(h[5].offset == -2);
    CHECK(h[6].type == ShapeType::kMesh);
    REQUIRE(h[6].mesh);
    CHECK(h[6].mesh->triangles().size() == 1);
    for (const std::size_t k : {0, 1, 2, 3, 4, 6}) {
        CAPTURE(k);
        CHECK(h[k].X_BS.p == Vec3(1, 2, 3));
        CHECK((h[k].X_BS.q.coeffs() - Quat(0.6, 0.8, 0, 0).coeffs()).norm() < 1e-15);
    }
}

TEST_CASE("a plane ignores a pose of its own") {
    const Scene s =
        parse(scene(fixed(R"({"type": "plane", "normal": [0, 0, 1], "offset": 0, "position": [5, 5, 5], "rotation": [0, 1, 0, 0]})")));
    CHECK(s.bodies.at(0).shapes.at(0).X_BS.p.isZero(0));
}

TEST_CASE("joints find their bodies by name and null is the world") {
    const std::string two = ball("a") + "," + ball("b");
    const Scene s = parse(scene(two, R"({"type": "ball", "body_a": null, "body_b": "b", "anchor": [1, 2, 3]},
        {"type": "hinge", "body_a": "b", "body_b": "a", "anchor": [0, 0, 0], "axis": [0, 0, 2], "collide_connected": true},
        {"type": "slider", "body_a": "a", "body_b": null, "anchor": [0, 0, 0], "axis": [1, 0, 0]},
        {"type": "fixed", "body_a": "a", "body_b": "b", "anchor": [0, 0, 0]},
        {"type": "distance", "body_a": "a", "body_b": "b", "anchor_a": [1, 0, 0], "anchor_b": [0, 1, 0]})"));
    REQUIRE(s.joints.size() == 5);
    CHECK(s.joints[0].def.type == JointType::kBall);
    CHECK_FALSE(s.joints[0].body_a.has_value());
    CHECK(s.joints[0].body_b == 1u);
    CHECK(s.joints[0].def.anchor_a == Vec3(1, 2, 3));
    CHECK(s.joints[0].def.anchor_b == Vec3(1, 2, 3));
    CHECK_FALSE(s.joints[0].def.collide_connected);
    CHECK(s.joints[1].def.type == JointType::kHinge);
    CHECK(s.joints[1].def.axis == Vec3(0, 0, 1));
    CHECK(s.joints[1].def.collide_connected);
    CHECK(s.joints[2].def.type == JointType::kSlider);
    CHECK(s.joints[3].def.type == JointType::kFixed);
    CHECK(s.joints[4].def.type == JointType::kDistance);
    CHECK(s.joints[4].def.anchor_a == Vec3(1, 0, 0));
    CHECK(s.joints[4].def.anchor_b == Vec3(0, 1, 0));
}

TEST_CASE("a quaternion within a thousandth of unit length is made one") {
    const Scene s = parse(scene(ball("b", R"("rotation": [0.6004, 0.8004, 0, 0])")));
    CHECK(std::abs(s.bodies.at(0).rotation.norm() - 1) < 1e-15);
}

TEST_CASE("a flat body's moments pass and so does a body of products of inertia about its origin") {
    CHECK(mistakes(scene(ball("b", R"("inertia": [1, 2, 3])"))).empty());
    const std::string two_balls =
        R"({"type": "sphere", "radius": 1, "position": [1, 1, 0]}, {"type": "sphere", "radius": 1, "position": [-1, -1, 0]})";
    CHECK(mistakes(scene(shaped(two_balls))).empty());
}

TEST_CASE("a centroid away from the origin is right when the inertia is given") {
    CHECK(mistakes(scene(shaped(R"({"type": "sphere", "radius": 1, "position": [1, 0, 0]})", R"("inertia": [1, 1, 1])"))).empty());
}
