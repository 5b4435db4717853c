#include "tests/cli/program.hpp"
#include "tests/support/catch.hpp"

#include <nlohmann/json.hpp>

#include <string>

namespace {

const std::string kStack = CAIRN_SCENES "/stack_10.json", kHeavy = CAIRN_SCENES "/heavy_on_light.json";
}  // namespace

TEST_CASE("diagnose says that nothing is wrong, with the numbers, and ends with 0") {
    const ProgramResult r = run_cairn("diagnose " + kStack + " --quiet");
    CAPTURE(r.out, r.err);
    CHECK(r.exit_code == 0);
    CHECK(r.out.find("stack_10: nothing wrong found") == 0);
    CHECK(r.out.find("10, and move") != std::string::npos);
}

TEST_CASE("diagnose names the cause, the bodies and the setting that cures it, with numbers before and after, and ends with 1") {
    const ProgramResult r = run_cairn("diagnose " + kHeavy + " --solver si --quiet");
    CAPTURE(r.out, r.err);
    CHECK(r.exit_code == 1);
    for (const char* part : {"cause (mass-ratio)", "box2 (200 kg)", "box1 (2 kg)", "tried --solver auto", "before", "cured"})
        CHECK(r.out.find(part) != std::string::npos);
}

TEST_CASE("diagnose --json tells the same to programs") {
    const ProgramResult r = run_cairn("diagnose " + kHeavy + " --solver si --json");
    REQUIRE(r.exit_code == 1);
    const nlohmann::json line = nlohmann::json::parse(r.last_line());
    CHECK(line.at("scene") == "heavy_on_light");
    CHECK(line.at("measured").at("resting_bodies") == 3);
    REQUIRE(line.at("findings").size() == 1);
    const nlohmann::json& f = line.at("findings").at(0);
    CHECK(f.at("cause") == "mass-ratio");
    CHECK(f.at("bodies") == nlohmann::json({"box2", "box1"}));
    CHECK(f.at("cured_by") == "--solver auto");
    CHECK(f.at("before") > f.at("limit"));
    CHECK(f.at("tried").back().at("after") < f.at("limit"));
}

TEST_CASE("diagnose says when a forced solver cannot take the scene") {
    const ProgramResult r = run_cairn("diagnose " + kStack + " --solver rattle --quiet");
    CHECK(r.exit_code == 1);
    CHECK(r.out.find("the run was stopped") != std::string::npos);
}
