#include "tests/cli/program.hpp"
#include "tests/support/catch.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace {

std::vector<std::string> cells_of(const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
}

}  // namespace

TEST_CASE("run --report writes a row a step whose causes of energy add up, and changes no result") {
    const TemporaryFolder folder;
    const std::string scene = CAIRN_SCENES "/slide_stop.json", report = folder.file("report.csv");
    const std::string plain = folder.file("plain.csv"), measured = folder.file("measured.csv");
    REQUIRE(run_cairn("run " + scene + " --quiet --states " + plain).exit_code == 0);
    REQUIRE(run_cairn("run " + scene + " --quiet --states " + measured + " --report " + report).exit_code == 0);
    CHECK(read_text(plain) == read_text(measured));
    std::istringstream lines(read_text(report));
    std::string line;
    REQUIRE(std::getline(lines, line));
    const std::vector<std::string> head = cells_of(line);
    REQUIRE(head.size() == 26);
    CHECK(head.front() == "t");
    CHECK(head.back() == "remainder");
    long rows = 0;
    while (std::getline(lines, line)) {
        const std::vector<std::string> cells = cells_of(line);
        REQUIRE(cells.size() == head.size());
        ++rows;
        double causes = 0;
        for (std::size_t k = 17; k < cells.size(); ++k) causes += std::stod(cells[k]);
        CHECK(std::abs(causes - std::stod(cells[15])) < 1e-12);  // kinetic_change; sums of some 10 J
    }
    CHECK(rows > 60);
}

TEST_CASE("run --report to a .jsonl file writes the islands as well") {
    const TemporaryFolder folder;
    const std::string report = folder.file("report.jsonl");
    REQUIRE(run_cairn("run " CAIRN_SCENES "/stack_10.json --quiet --report " + report).exit_code == 0);
    std::istringstream lines(read_text(report));
    std::string line;
    REQUIRE(std::getline(lines, line));
    const nlohmann::json step = nlohmann::json::parse(line);
    REQUIRE(step.at("islands").size() == 1);
    CHECK(step.at("islands").at(0).at("bodies") == 10);
    CHECK(step.at("islands").at(0).at("solver") == "direct");
    CHECK(step.at("islands").at(0).at("reason").is_string());
    CHECK(step.at("energy").at("remainder").is_number());
    CHECK(step.at("residual").at("rows") == 120);
}
