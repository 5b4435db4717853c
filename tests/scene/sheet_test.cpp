// What `cairn study` claims of the models of sequential impulses, at small size, on the shipped scenes of the sheet.
#include "engine/scene/scene.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <string>

using namespace cairn;

namespace {

constexpr Real kDt = 1.0 / 60;

Scene sheet(const std::string& name) {
    return load_scene(std::string(CAIRN_SCENES) + "/sheet_" + name + ".json");
}

WorldSettings si() {
    WorldSettings s;
    s.solver = SolverChoice::kSi;
    return s;
}

// One substep, ten sweeps, target velocity, fixed tangents, impulses from zero.
WorldSettings textbook() {
    WorldSettings s = si();
    s.substeps = 1;
    s.iterations = 10;
    s.residual_tolerance = 0;
    s.stabilisation = Stabilisation::kTargetVelocity;
    s.model.friction = FrictionModel::kPyramidFixed;
    s.model.warm_start = false;
    return s;
}

std::size_t body_named(const Scene& scene, const std::string& name) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
        if (scene.bodies[i].name == name) return i;
    FAIL("no body " + name);
    return 0;
}

// Largest distance [m] of a dynamic body from its start, after so long [s].
Real drift(const Scene& scene, const WorldSettings& settings, Real duration) {
    SceneWorld built = build_world(scene, settings);
    for (int k = 0; k < std::lround(duration / kDt); ++k) built.world.step(kDt);
    Real worst = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
        if (scene.bodies[i].type == BodyType::kDynamic)
            worst = std::max(worst, (built.world.state(built.ids[i]).position - scene.bodies[i].position).norm());
    return worst;
}

Real stop_error(Real angle, FrictionModel friction) {
    Scene scene = sheet("slide");
    BodyDef& box = scene.bodies[body_named(scene, "box")];
    const Quat turn = exp_rotation(angle * Vec3::UnitZ());
    box.linear_velocity = turn * box.linear_velocity;
    box.rotation = turn * box.rotation;
    WorldSettings settings = si();
    settings.model.friction = friction;
    const Real truth = box.linear_velocity.squaredNorm() / (2 * box.friction * 9.81);
    return drift(scene, settings, scene.duration) / truth - 1;
}

}  // namespace

// Without friction, as the sheet has it at this point; 200 sweeps, so that the step is solved as well as the clamp lets it.
TEST_CASE("a stack whose boxes do not align needs the accumulated clamp") {
    const Scene scene = sheet("shifted_stack");
    WorldSettings settings = textbook();
    settings.iterations = 200;
    settings.model.friction = FrictionModel::kNone;
    const Real accumulated = drift(scene, settings, 4);
    settings.model.clamp = Clamp::kPerIteration;
    const Real per_iteration = drift(scene, settings, 4);
    CAPTURE(accumulated, per_iteration);
    CHECK(accumulated < 0.01);   // a hundredth of a box
    CHECK(per_iteration > 0.5);  // half a box: no box stands on the one below any more
}

TEST_CASE("an aligned stack cannot tell the clamps apart") {
    const Scene scene = sheet("stack");
    WorldSettings settings = textbook();
    const Real accumulated = drift(scene, settings, 2);
    settings.model.clamp = Clamp::kPerIteration;
    CHECK(drift(scene, settings, 2) == Approx(accumulated).epsilon(0.01));
}

TEST_CASE("a box on a slope of 0.95 of its friction angle creeps with friction along one direction, not with the pyramid") {
    const Scene scene = sheet("slope");
    WorldSettings settings = si();
    settings.model.friction = FrictionModel::kPyramid;
    const Real pyramid = drift(scene, settings, 8);
    settings.model.friction = FrictionModel::kOneDirection;
    const Real one = drift(scene, settings, 8);
    CAPTURE(pyramid, one);
    CHECK(pyramid < 1e-3);
    CHECK(one > 10 * pyramid);
    CHECK(one > 1e-3);
}

TEST_CASE("with tangents along the slip the stop distance is right in every direction, with fixed tangents it is not") {
    for (const Real degrees : {0.0, 22.5, 45.0}) {
        CAPTURE(degrees);
        const Real angle = degrees * kPi / 180;
        CHECK(std::abs(stop_error(angle, FrictionModel::kPyramid)) < 0.005);
        CHECK(std::abs(stop_error(angle, FrictionModel::kCone)) < 0.005);
    }
    // The corner of the square bound is √2 away: at 45° the box stops after 1/√2 of the way.
    CHECK(std::abs(stop_error(kPi / 4, FrictionModel::kPyramidFixed) - (1 / std::sqrt(2.0) - 1)) < 0.03);
    CHECK(std::abs(stop_error(0, FrictionModel::kPyramidFixed)) < 0.005);
}

TEST_CASE("a row without lambda >= 0 glues, one without lambda C = 0 holds a ball in the air") {
    WorldSettings settings = textbook();
    settings.iterations = 200;
    const Scene lift = sheet("lift");
    settings.model.clamp = Clamp::kNone;
    CHECK(drift(lift, settings, 0.2) < 1e-6);  // held to what 200 sweeps of four rows leave
    settings.model.clamp = Clamp::kAccumulated;
    CHECK(drift(lift, settings, 0.2) > 0.1);  // 2 m/s · 0.2 s − g 0.02 s²

    const Scene drop = sheet("drop");
    const auto gap = [&] { return 1 - drift(drop, settings, 2); };
    CHECK(std::abs(gap()) < 1e-9);
    settings.model.complementarity = false;
    CHECK(gap() > 0.01);
}

TEST_CASE("only a target velocity or a push brings back what is sunk, and only the target velocity throws it") {
    const Scene scene = sheet("sunk");
    const std::size_t box = body_named(scene, "box");
    for (const Stabilisation how : {Stabilisation::kNone, Stabilisation::kTargetVelocity, Stabilisation::kSplit, Stabilisation::kSoft}) {
        CAPTURE(static_cast<int>(how));
        WorldSettings settings = textbook();
        settings.stabilisation = how;
        settings.iterations = 100;
        SceneWorld built = build_world(scene, settings);
        Real fastest = 0;
        for (int k = 0; k < 120; ++k) {
            built.world.step(kDt);
            fastest = std::max(fastest, built.world.state(built.ids[box]).linear_velocity.z());
        }
        const Real height = built.world.state(built.ids[box]).position.z();
        if (how == Stabilisation::kNone) CHECK(height < 0.451);
        if (how != Stabilisation::kNone) CHECK(height > 0.49);
        // β C / h = 0.2 · 0.05 m · 60 / s
        if (how == Stabilisation::kTargetVelocity) CHECK(fastest == Approx(0.6).epsilon(0.05));
        if (how == Stabilisation::kSplit) CHECK(fastest < 1e-6);
    }
}

TEST_CASE("the sheet's stacks, throws and slopes run in the engine as it comes") {
    for (const char* name : {"stack", "shifted_stack", "light_heavy"}) {
        CAPTURE(name);
        CHECK(drift(sheet(name), {}, 2) < 0.05);
    }
    CHECK(drift(sheet("throw"), {}, 1.5) > 1);  // the ball has hit something
    CHECK(drift(sheet("ball"), {}, 1) < 1e-9);
    CHECK(drift(sheet("push"), {}, 1) == Approx(1.25).epsilon(1e-6));  // F t² / 2m: nothing holds it
}
