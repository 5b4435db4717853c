// Each cause on a small scene that has it and nothing else; sound scenes have none.
#include "apps/cli/diagnose/diagnose.hpp"

#include "apps/cli/diagnose/limits.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>

using namespace cairn;
using namespace cairn::cli;

namespace {

BodyDef fixed_body(const std::string& name, const Shape& shape, const Vec3& position = Vec3::Zero()) {
    BodyDef b;
    b.name = name;
    b.type = BodyType::kStatic;
    b.position = position;
    b.shapes = {shape};
    return b;
}

BodyDef box(const std::string& name, const Vec3& position, Real mass = 1) {
    BodyDef b;
    b.name = name;
    b.position = position;
    b.mass = mass;
    b.shapes = {Shape::box({0.5, 0.5, 0.5})};
    return b;
}

Scene on_ground(Real duration = 2) {
    Scene s;
    s.name = "test";
    s.duration = duration;
    s.sample_interval = duration;
    s.bodies.push_back(fixed_body("ground", Shape::plane(Vec3::UnitZ(), 0)));
    return s;
}

Scene stack(int count, Real duration = 2) {
    Scene s = on_ground(duration);
    for (int k = 0; k < count; ++k) s.bodies.push_back(box("box" + std::to_string(k), {0, 0, 0.5 + k}));
    return s;
}

RunOptions with_solver(SolverChoice solver) {
    RunOptions options;
    options.solver = solver;
    return options;
}

std::vector<Finding> diagnosed(const Scene& scene, const RunOptions& options = {}) {
    const Evidence evidence = observe(scene, options);
    const Case c{scene, options, evidence};
    std::vector<Finding> findings = find_causes(c);
    for (Finding& f : findings) try_cures(c, f);
    return findings;
}

// The one cause that is found; "" if there is none or more than one.
std::string only_cause(const std::vector<Finding>& findings) {
    return findings.size() == 1 ? findings[0].cause : "";
}

std::string cured_by(const Finding& f) {
    for (const Trial& t : f.trials)
        if (t.cured) return t.says;
    return "";
}

bool names(const Finding& f, const std::string& body) {
    return std::find(f.bodies.begin(), f.bodies.end(), body) != f.bodies.end();
}

}  // namespace

TEST_CASE("nothing is wrong with a stack that stands, a pendulum that swings, and a ball that rolls or bounces") {
    for (const char* name : {"stack_10", "pendulum", "bounce", "slide_roll", "incline_stick", "chain_10"}) {
        CAPTURE(name);
        const Scene scene = load_scene(std::string(CAIRN_SCENES "/") + name + ".json");
        CHECK(diagnosed(scene).empty());
    }
}

TEST_CASE("a heavy box on a light one that sweeps cannot hold is told as a mass ratio, which a direct solve cures") {
    Scene scene = on_ground(3);
    scene.bodies.push_back(box("light", {0, 0, 0.5}, 1));
    scene.bodies.push_back(box("middle", {0, 0, 1.5}, 1));
    scene.bodies.push_back(box("heavy", {0, 0, 2.5}, 300));
    const std::vector<Finding> findings = diagnosed(scene, with_solver(SolverChoice::kSi));
    REQUIRE(only_cause(findings) == "mass-ratio");
    CHECK(names(findings[0], "heavy"));
    CHECK(names(findings[0], "middle"));
    CHECK(cured_by(findings[0]) == "--solver auto");
    CHECK(findings[0].trials.back().after < 1e-3 * findings[0].symptom->value);
    CHECK(diagnosed(scene).empty());  // and so it is with the defaults
}

TEST_CASE("a stack of equal boxes that few sweeps cannot hold is told as the cap of the sweeps, which more of them cure") {
    RunOptions options = with_solver(SolverChoice::kSi);
    options.iterations = 1;
    const std::vector<Finding> findings = diagnosed(stack(8, 4), options);
    REQUIRE(only_cause(findings) == "iteration-cap");
    CHECK(cured_by(findings[0]) == "--iterations 10");
}

TEST_CASE("a stack that is stepped too coarsely is told as a long step, which a shorter one cures") {
    RunOptions options = with_solver(SolverChoice::kSi);
    options.dt = 0.1;
    const std::vector<Finding> findings = diagnosed(stack(5, 4), options);
    REQUIRE(only_cause(findings) == "long-step");
    CHECK(cured_by(findings[0]).substr(0, 5) == "--dt ");
}

TEST_CASE("boxes that overlap at the start are told with their depth, and moving one cures it") {
    Scene scene = on_ground();
    scene.bodies.push_back(box("low", {0, 0, 0.5}));
    scene.bodies.push_back(box("high", {0, 0, 1.3}));
    const std::vector<Finding> findings = diagnosed(scene);
    REQUIRE(only_cause(findings) == "overlap");
    CHECK(names(findings[0], "low"));
    CHECK(names(findings[0], "high"));
    CHECK(std::abs(findings[0].symptom->value - 0.2) < 1e-9);
    CHECK(cured_by(findings[0]) == "move high by [0, 0, 0.2] m in the scene");
}

TEST_CASE("a box on a slope steeper than its friction is told with both, and more friction cures it") {
    Scene scene = on_ground();
    scene.gravity = {9.81 * std::sin(0.4), 0, -9.81 * std::cos(0.4)};  // tan 0.4 = 0.423
    scene.bodies.push_back(box("block", {0, 0, 0.5}));
    for (BodyDef& b : scene.bodies) b.friction = 0.3;
    const std::vector<Finding> findings = diagnosed(scene);
    REQUIRE(only_cause(findings) == "friction");
    CHECK(names(findings[0], "block"));
    CHECK(cured_by(findings[0]).substr(0, 14) == "friction 0.465");  // 1.1 tan 0.4
    for (BodyDef& b : scene.bodies) b.friction = 0.5;
    CHECK(diagnosed(scene).empty());
}

TEST_CASE("a box whose centre of mass is beside what bears it is told so, and moving it cures it") {
    Scene scene = on_ground(1.5);
    scene.bodies.push_back(fixed_body("table", Shape::box({1, 1, 0.5}), {0, 0, 0.5}));
    scene.bodies.push_back(box("box", {1.1, 0, 1.5}));
    const std::vector<Finding> findings = diagnosed(scene);
    REQUIRE(only_cause(findings) == "support");
    CHECK(names(findings[0], "box"));
    CHECK(findings[0].says.find("0.1 m beside its support") != std::string::npos);
    CHECK(cured_by(findings[0]).substr(0, 8) == "move box");
}

TEST_CASE("a stack that leans too far is told with all that topples together") {
    Scene scene = on_ground();
    for (int k = 0; k < 4; ++k) scene.bodies.push_back(box("b" + std::to_string(k), {0.35 * k, 0, 0.5 + k}));
    const std::vector<Finding> findings = diagnosed(scene);
    REQUIRE(only_cause(findings) == "support");
    // The upper three, at 0.7 m on average, over a box that ends at 0.5 m; all four are only 0.025 m beside their foot.
    CHECK(findings[0].bodies == std::vector<std::string>{"b1", "b2", "b3"});
    CHECK(findings[0].says.find("0.2 m beside its support") != std::string::npos);
}

TEST_CASE("a box that stands on an edge is told to do so") {
    Scene scene = on_ground();
    BodyDef b = box("box", {0, 0, std::sqrt(0.5)});
    b.rotation = exp_rotation(Vec3(0, kPi / 4 + 1e-5, 0));
    scene.bodies.push_back(b);
    const std::vector<Finding> findings = diagnosed(scene);
    REQUIRE(only_cause(findings) == "support");
    CHECK(findings[0].says.find("edge") != std::string::npos);
    CHECK_FALSE(findings[0].no_cure.empty());
}

TEST_CASE("a ball on a slope is told to roll, and rolling friction holds it") {
    Scene scene = on_ground();
    scene.gravity = {9.81 * std::sin(0.1), 0, -9.81 * std::cos(0.1)};
    BodyDef ball;
    ball.name = "ball";
    ball.position = {0, 0, 0.5};
    ball.shapes = {Shape::sphere(0.5)};
    scene.bodies.push_back(ball);
    const std::vector<Finding> findings = diagnosed(scene);
    REQUIRE(only_cause(findings) == "support");
    CHECK(findings[0].says.find("beside the point it rests on") != std::string::npos);
    const std::string cure = cured_by(findings[0]);
    REQUIRE(cure.substr(0, 17) == "rolling_friction ");
    // r tan α and a tenth more; its contact is looked at after one step, in which it rolls a t²/2 · 5/7 = 0.1 mm.
    CHECK(std::abs(std::stod(cure.substr(17)) - 1.1 * 0.5 * std::tan(0.1)) < 2e-4);
}

TEST_CASE("a chain that is drawn out beyond its length is told so, and that no setting helps") {
    Scene scene;
    scene.name = "drawn";
    scene.gravity.setZero();  // a chain that is as long as its span hangs in it only with infinite tension
    scene.duration = 1;
    scene.sample_interval = 1;
    BodyDef cart;
    cart.name = "cart";
    cart.type = BodyType::kKinematic;
    cart.position = {2, 0, 0};
    cart.linear_velocity = {1, 0, 0};
    scene.bodies.push_back(cart);
    for (int k = 0; k < 2; ++k) {
        BodyDef link = box("link" + std::to_string(k), {0.5 + k, 0, 0});
        link.shapes = {Shape::capsule(0.05, 0.3)};
        scene.bodies.push_back(link);
    }
    const auto join = [&](std::optional<std::size_t> a, std::optional<std::size_t> b, Real x) {
        SceneJoint j;
        j.def.type = JointType::kBall;
        j.def.anchor_a = {x, 0, 0};
        j.body_a = a;
        j.body_b = b;
        scene.joints.push_back(j);
    };
    join(std::nullopt, 1, 0);
    join(1, 2, 1);
    join(2, 0, 2);
    const std::vector<Finding> findings = diagnosed(scene);
    REQUIRE_FALSE(findings.empty());
    CHECK(findings[0].cause == "reach");
    CHECK(names(findings[0], "cart"));
    CHECK(names(findings[0], "the world"));
    CHECK(findings[0].says.find("reaches 2 m") != std::string::npos);
    CHECK(findings[0].trials.empty());
    CHECK_FALSE(findings[0].no_cure.empty());
    scene.bodies[0].linear_velocity.setZero();
    CHECK(diagnosed(scene).empty());
}

TEST_CASE("what a moving body hits is not said to fail") {
    Scene scene = stack(3);
    BodyDef ball;
    ball.name = "ball";
    ball.position = {-3, 0, 2.5};
    ball.linear_velocity = {8, 0, 0};
    ball.mass = 5;
    ball.shapes = {Shape::sphere(0.4)};
    scene.bodies.push_back(ball);
    CHECK(diagnosed(scene).empty());
}

TEST_CASE("a cure counts as one only if the symptom is gone") {
    const Scene scene = stack(8, 4);
    RunOptions options = with_solver(SolverChoice::kSi);
    options.iterations = 1;
    const Evidence evidence = observe(scene, options);
    const Case c{scene, options, evidence};
    std::vector<Finding> findings = find_causes(c);
    REQUIRE(findings.size() == 1);
    Finding& f = findings[0];
    f.cures = {{"nothing", [](Scene&, RunOptions&) {}},
               {"--solver rattle", [](Scene&, RunOptions& o) { o.solver = SolverChoice::kRattle; }}};
    try_cures(c, f);
    REQUIRE(f.trials.size() == 1);  // rattle cannot take contacts, and so tells nothing
    CHECK_FALSE(f.trials[0].cured);
    CHECK(f.trials[0].after == f.symptom->value);
}

TEST_CASE("where no known cause fits, that is said, and settings are tried all the same") {
    const Scene scene = stack(2);
    const Evidence evidence = observe(scene, {});
    Symptom s;
    s.kind = SymptomKind::kMoves;
    s.index = 2;
    s.group = evidence.bodies[2].group;
    s.value = 1;
    s.limit = 0.1;
    const RunOptions options;
    const Case c{scene, options, evidence};
    CHECK_FALSE(find_mass_ratio(c, s));
    CHECK_FALSE(find_long_step(c, s));
    CHECK_FALSE(find_iteration_cap(c, s));
    CHECK_FALSE(find_steep_slope(c, s));
    CHECK_FALSE(find_weak_support(c, s));
    CHECK_FALSE(find_reach(c, s));
    CHECK(find_overlaps(c).empty());
    const Finding f = unknown_cause(c, s);
    CHECK(f.cause == "unknown");
    CHECK(f.cures.size() >= 2);
}
