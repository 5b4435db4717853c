#include "tests/cli/program.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <filesystem>

TEST_CASE("help explains with examples and exits with 0") {
    for (const char* command : {"run", "list", "scenes", "bench", "stress", "report"}) {
        const ProgramResult r = run_cairn(std::string(command) + " --help");
        CAPTURE(command, r.out);
        CHECK(r.exit_code == 0);
        CHECK(r.out.find("Usage") != std::string::npos);
        if (std::string(command) != "list") CHECK(r.out.find("Examples:") != std::string::npos);
    }
    CHECK(run_cairn("--help").exit_code == 0);
}

TEST_CASE("list has a line for each shipped scene") {
    const ProgramResult r = run_cairn("list");
    CHECK(r.exit_code == 0);
    std::ptrdiff_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(CAIRN_SCENES)) {
        if (entry.path().extension() != ".json") continue;
        ++files;
        CAPTURE(entry.path().string());
        CHECK(r.out.find("\n" + entry.path().stem().string() + " ") != std::string::npos);
    }
    CHECK(std::count(r.out.begin(), r.out.end(), '\n') == files + 1);  // and the heading
}

TEST_CASE("generated scenes are right scene files, the same for the same seed and others for another") {
    const TemporaryFolder a, b, c;
    const std::string kinds = "scenes stack_3 pyramid_3 wall_2 pile_9 balls_5 hulls_4 chain_3 ragdolls_2 ";
    const ProgramResult made = run_cairn(kinds + "--out " + a.path());
    CAPTURE(made.err);
    REQUIRE(made.exit_code == 0);
    REQUIRE(run_cairn(kinds + "--out " + b.path()).exit_code == 0);
    REQUIRE(run_cairn(kinds + "--seed 2 --out " + c.path()).exit_code == 0);
    int count = 0, changed = 0;
    for (const auto& entry : std::filesystem::directory_iterator(a.path())) {
        const std::string name = entry.path().filename().string();
        CAPTURE(name);
        CHECK((read_text(a.file(name)) == read_text(b.file(name))));
        if (read_text(a.file(name)) != read_text(c.file(name))) ++changed;
        const ProgramResult r = run_cairn("run " + a.file(name) + " --quiet");
        CAPTURE(r.err);
        CHECK(r.exit_code == 0);
        ++count;
    }
    CHECK(count == 8);
    CHECK(changed == 4);  // pile, balls, hulls, ragdolls; the others hold no random number
}

TEST_CASE("scenes takes a count for a kind and refuses what it cannot make") {
    const TemporaryFolder folder;
    REQUIRE(run_cairn("scenes pyramid --count 4 --out " + folder.path()).exit_code == 0);
    CHECK(std::filesystem::exists(folder.file("pyramid_4.json")));
    const ProgramResult kind = run_cairn("scenes castle --out " + folder.path());
    CHECK(kind.exit_code == 2);
    CHECK(kind.err.find("kind of scene: castle, must be one of stack, pyramid") != std::string::npos);
    const ProgramResult zero = run_cairn("scenes stack --count 0 --out " + folder.path());
    CHECK(zero.exit_code == 2);
    CHECK(zero.err.find("stack: --count: 0, must be from 1 to ") != std::string::npos);
    CHECK(run_cairn("scenes stack_3 --out /dev/null/x").exit_code == 2);
}

TEST_CASE("bench prints a row with an error against the truth") {
    const ProgramResult r = run_cairn("bench --filter projectile --engines cairn --repeats 1");
    CAPTURE(r.out, r.err);
    CHECK(r.exit_code == 0);
    CHECK(r.out.find("\nprojectile ") != std::string::npos);
    CHECK(r.out.find("off the parabola [m]") != std::string::npos);
    CHECK(run_cairn("bench --filter no_such_scene").exit_code == 2);
}
