#include "tests/cli/program.hpp"
#include "tests/support/catch.hpp"

#include <filesystem>

#include <nlohmann/json.hpp>

namespace fs = std::filesystem;

TEST_CASE("study without a topic lists them, in the order of the sheet") {
    const ProgramResult r = run_cairn("study");
    CHECK(r.exit_code == 0);
    std::size_t at = 0;
    for (const char* id : {"1a", "1b", "1c", "1lcp", "1d", "1e", "1f", "1g", "1h", "2a", "2b", "2c", "2d", "2e", "2f"}) {
        CAPTURE(id, r.out);
        const std::size_t found = r.out.find(std::string("\n") + id + " ", at == 0 ? 0 : at);
        CHECK((found != std::string::npos || r.out.rfind(std::string(id) + " ", 0) == 0));
        if (found != std::string::npos) at = found;
    }
}

TEST_CASE("a study prints its question, a table and a verdict, and the same again") {
    const ProgramResult first = run_cairn("study 1b 2a --quick"), second = run_cairn("study 1b 2a --quick");
    CHECK(first.exit_code == 0);
    CHECK(first.out.find("1b The velocity map\nWhat is G_N") != std::string::npos);
    CHECK(first.out.find("largest error") != std::string::npos);
    CHECK(first.out.find("\n  → Forces agree to ") != std::string::npos);
    CHECK(first.out == second.out);
}

TEST_CASE("a study writes tables and figures to the folder that it is given") {
    const TemporaryFolder folder;
    const ProgramResult r = run_cairn("study 1a --quick --out " + folder.file("figures"));
    CAPTURE(r.err);
    CHECK(r.exit_code == 0);
    const std::string table = read_text(folder.file("figures/1a_push.csv"));
    CHECK(table.rfind("run,force [N],", 0) == 0);
    CHECK(read_text(folder.file("figures/1a_contact.gp")).find("plot '1a_contact.dat' index 0") != std::string::npos);
    CHECK(read_text(folder.file("figures/1a_contact.dat")).find("# n\n") != std::string::npos);
    // Drawn, or said why not.
    CHECK((fs::exists(folder.file("figures/1a_contact.png")) || r.err.find("gnuplot was not found") != std::string::npos));
}

TEST_CASE("without gnuplot a study says so, and leaves what gnuplot needs") {
    const TemporaryFolder folder;
    const ProgramResult r = run_cairn("study 1a --quick --out " + folder.path(), "PATH=/nowhere");
    CHECK(r.exit_code == 0);
    CHECK(r.err.find("gnuplot was not found") != std::string::npos);
    CHECK(fs::exists(folder.file("1a_contact.gp")));
    CHECK_FALSE(fs::exists(folder.file("1a_contact.png")));
}

TEST_CASE("a topic that is none is refused with the list of them") {
    const ProgramResult r = run_cairn("study 9z");
    CHECK(r.exit_code == 2);
    CHECK(r.err.find("TOPIC: 9z, must be one of all, 1a, 1b") != std::string::npos);
    CHECK(run_cairn("study 1a --write-docs x").exit_code == 2);
}

TEST_CASE("run takes the models of sequential impulses and says which it ran") {
    const ProgramResult r = run_cairn(
        "run sheet_ball --json --quiet --clamp per-iteration --complementarity off --warm-start off --friction cone --order contacts-first "
        "--method nncg --relaxation 1.2 --until 1e-6 --stabilisation soft");
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
    const nlohmann::json settings = nlohmann::json::parse(r.last_line()).at("settings");
    CHECK(settings.at("solver") == "si");
    CHECK(settings.at("stabilisation") == "soft");
    CHECK(settings.at("residual_tolerance") == 1e-6);
    CHECK(settings.at("model") == nlohmann::json{{"clamp", "per-iteration"},
                                                 {"complementarity", "off"},
                                                 {"warm_start", "off"},
                                                 {"friction", "cone"},
                                                 {"order", "contacts-first"},
                                                 {"method", "nncg"},
                                                 {"relaxation", 1.2}});
}

TEST_CASE("a model that is none is refused with what would be one") {
    const std::pair<const char*, const char*> cases[] = {
        {"--clamp some", "--clamp: some, must be one of none, per-iteration, accumulated"},
        {"--complementarity maybe", "--complementarity: maybe, must be one of on, off"},
        {"--friction disc", "--friction: disc, must be one of none, one-direction, pyramid-fixed, pyramid, cone"},
        {"--order last", "--order: last, must be one of joints-first, contacts-first"},
        {"--method cg", "--method: cg, must be one of pgs, nncg"},
        {"--relaxation 2", "--relaxation: 2, must be > 0 and < 2"},
    };
    for (const auto& [arguments, message] : cases) {
        const ProgramResult r = run_cairn(std::string("run sheet_ball ") + arguments);
        CAPTURE(arguments, r.err);
        CHECK(r.exit_code == 2);
        CHECK(r.err.find(message) != std::string::npos);
    }
}
