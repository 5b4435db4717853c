#include "apps/cli/engine_run.hpp"
#include "apps/cli/external_run.hpp"
#include "apps/cli/shipped_scenes.hpp"
#include "engine/base/error.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>

namespace {

using namespace cairn;
using namespace cairn::cli;

constexpr double kTimeout = 60;  // [s]; far beyond any run here, also under sanitizers

SceneFile shipped(const std::string& name) {
    return {load_scene(find_scene(name)), find_scene(name), ""};
}

}  // namespace

TEST_CASE("every engine that was built lets a body fall as far as its order of integration says") {
    const SceneFile file = shipped("projectile");
    EngineSettings settings;
    settings.dt = 1.0 / 240;
    for (const std::string& name : engine_names()) {
        CAPTURE(name);
        const EngineRun run = run_engine({name, ""}, file, settings, kTimeout);
        REQUIRE(std::string(to_string(run.status)) == "ok");
        CHECK(run.history.t.back() == Approx(file.scene.duration));
        CHECK(run.settings != "");
        // Symplectic Euler is g t dt / 2 off the parabola after the time t; no engine is worse, single precision adds less than 1 mm.
        const Real bound = 9.81 * file.scene.duration * settings.dt / 2 + 1e-3;
        CHECK(parabola(file.scene, run.history).value <= bound);
    }
}

TEST_CASE("every engine that was built takes every kind of joint") {
    for (const std::string& name : engine_names()) {
        for (const char* scene : {"pendulum", "double_pendulum", "rod_pendulum", "slider", "fixed_beam", "top", "ragdoll"}) {
            CAPTURE(name, scene);
            SceneFile file = shipped(scene);
            file.scene.duration = 0.1;
            EngineSettings settings;
            settings.dt = 1.0 / 240;
            const EngineRun run = run_engine({name, ""}, file, settings, kTimeout);
            REQUIRE(std::string(to_string(run.status)) == "ok");
            // A joint that is not there lets its body fall freely; one taken wrongly throws it. After 0.1 s nothing that hangs or stands
            // has gone farther than a free fall from the speeds that it has, twice over.
            for (std::size_t i = 0; i < file.scene.bodies.size(); ++i) {
                const BodyDef& b = file.scene.bodies[i];
                const Real way = (run.history.states.back()[i].position - b.position).norm();
                CHECK(way <= 2 * (0.1 * b.linear_velocity.norm() + 0.05) + 0.1 * b.angular_velocity.norm());
            }
        }
    }
}

TEST_CASE("a beam on fixed joints hangs on them in every engine") {
    for (const std::string& name : engine_names()) {
        CAPTURE(name);
        SceneFile file = shipped("fixed_beam");
        file.scene.duration = 1;
        EngineSettings settings;
        settings.dt = 1.0 / 240;
        const EngineRun run = run_engine({name, ""}, file, settings, kTimeout);
        REQUIRE(std::string(to_string(run.status)) == "ok");
        // Iterative solvers let the beam bend, some by a lot; without its joints it would fall g t² / 2 = 4.9 m.
        CHECK(at_rest(file.scene, run.history).value < 2.45);
    }
}

TEST_CASE("a run repeated has the same state hash, another step has another") {
    const SceneFile file = shipped("slide_stop");
    EngineSettings settings;
    const EngineRun one = run_engine({"cairn", ""}, file, settings, kTimeout);
    const EngineRun two = run_engine({"cairn", ""}, file, settings, kTimeout);
    CHECK(one.state_hash == two.state_hash);
    settings.dt = 1.0 / 61;
    CHECK(run_engine({"cairn", ""}, file, settings, kTimeout).state_hash != one.state_hash);
}

TEST_CASE("the external protocol gives the states of the built-in engine, to the last bit") {
    const SceneFile file = shipped("bounce");
    EngineSettings settings;
    settings.dt = 1.0 / 120;
    settings.substeps = 3;
    const TemporaryFolder folder;
    const std::string program = CAIRN_PROGRAM;
    const EngineRun inside = run_engine({"cairn", ""}, file, settings, kTimeout);
    // The program takes its scene as the argument of `run`, so a runner is a script of one line.
    const std::string script = folder.file("cairn_runner.sh");
    {
        std::FILE* out = std::fopen(script.c_str(), "w");
        REQUIRE(out != nullptr);
        std::fprintf(out, "#!/bin/sh\nexec '%s' run --json --quiet \"$@\"\n", program.c_str());
        std::fclose(out);
    }
    const EngineRun outside = run_engine({"other", script}, file, settings, kTimeout);
    INFO(outside.note);
    // No execute bit: it must be said, not guessed.
    CHECK(std::string(to_string(outside.status)) == "failed");
    REQUIRE(std::system(("chmod +x '" + script + "'").c_str()) == 0);
    const EngineRun again = run_engine({"other", script}, file, settings, kTimeout);
    INFO(again.note);
    REQUIRE(std::string(to_string(again.status)) == "ok");
    REQUIRE(again.history.t.size() == inside.history.t.size());
    for (std::size_t k = 0; k < inside.history.t.size(); ++k) {
        CHECK(again.history.t[k] == inside.history.t[k]);
        CHECK(again.history.states[k].back().position == inside.history.states[k].back().position);
    }
    CHECK(again.steps == inside.steps);
    CHECK(again.wall_total > 0);
}

TEST_CASE("what an engine cannot do, and what goes wrong, is told and not taken for a result") {
    SceneFile file = shipped("slide_stop");
    EngineSettings settings;
    CHECK(std::string(to_string(run_engine({"none", "/bin/false"}, file, settings, kTimeout).status)) == "failed");
    CHECK(std::string(to_string(run_engine({"none", "/bin/true"}, file, settings, kTimeout).status)) == "failed");
    file.scene.duration = 1e5;
    CHECK(std::string(to_string(run_engine({"cairn", ""}, file, settings, 0.2).status)) == "timeout");
    file.scene.duration = 0.1;
    file.scene.bodies.back().rolling_friction = 0.1;
    for (const std::string& name : engine_names()) {
        if (name == "cairn") continue;
        CHECK(std::string(to_string(run_engine({name, ""}, file, settings, kTimeout).status)) == "unsupported");
    }
    CHECK_THROWS_AS(parse_engines("cairn,nonesuch", {}), Error);
    CHECK_THROWS_AS(parse_engines("cairn", {"nopath"}), Error);
    CHECK(parse_engines("cairn", {"a=/b"}).size() == 2);
}

TEST_CASE("a states file that cannot be read is refused with its line") {
    const Scene scene = shipped("projectile").scene;
    const std::string head = "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n", name = scene.bodies.front().name;
    CHECK_THROWS_AS(read_states("", scene), Error);
    CHECK_THROWS_WITH(read_states(head + "0," + name + ",1,2\n", scene), Catch::Contains("line 2"));
    const History read = read_states(head + "0.5," + name + ",1,2,3,1,0,0,0,4,5,6,7,8,9\n", scene);
    CHECK(read.t.at(0) == 0.5);
    CHECK(read.states.at(0).at(0).angular_velocity == Vec3(7, 8, 9));
}
