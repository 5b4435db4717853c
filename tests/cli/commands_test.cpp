#include "apps/cli/bench/results.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/catch.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

TEST_CASE("help explains with examples and exits with 0") {
    for (const char* command : {"run", "list", "scenes", "bench", "stress", "report", "study"}) {
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

TEST_CASE("no scene of the baseline has got less accurate") {
    // Written by tests/cli/accuracy_baseline.sh. Errors are the same wherever the bits are; another compiler may move the last digits,
    // which grow over some hundred steps to far below the threshold of 5 % in scenes that are not chaotic, as these.
    const std::string baseline = std::string(CAIRN_SOURCE) + "/tests/cli/accuracy_baseline.json";
    const nlohmann::json rows = nlohmann::json::parse(read_text(baseline)).at("rows");
    REQUIRE(rows.size() >= 15);
    std::string scenes;
    for (const nlohmann::json& row : rows) scenes += " --scene " + row.at("scene").get<std::string>();
    const ProgramResult r = run_cairn("bench --engines cairn --dt 1/60 --repeats 1" + scenes + " --compare " + baseline);
    CAPTURE(r.out, r.err);
    CHECK(r.exit_code == 0);
    CHECK(r.out.find(std::to_string(rows.size()) + " cases\n") != std::string::npos);
    CHECK(r.out.find("none got less accurate") != std::string::npos);
}

TEST_CASE("a comparison fails when an error has grown") {
    const TemporaryFolder folder;
    REQUIRE(run_cairn("bench --scene slide_stop --engines cairn --dt 1/60 --repeats 1 --out " + folder.path()).exit_code == 0);
    const std::string text = read_text(folder.file("results.json"));
    nlohmann::json better = nlohmann::json::parse(text);
    better["rows"][0]["error"] = better["rows"][0]["error"].get<double>() / 2;
    write_text(folder.file("better.json"), better.dump());
    const std::string again = "bench --scene slide_stop --engines cairn --dt 1/60 --repeats 1 --compare ";
    CHECK(run_cairn(again + folder.file("results.json")).exit_code == 0);
    const ProgramResult worse = run_cairn(again + folder.file("better.json"));
    CHECK(worse.exit_code == 1);
    CHECK(worse.out.find("less accurate:\n  slide_stop cairn dt=1/60") != std::string::npos);
}

TEST_CASE("a benchmark that was broken off goes on where it stopped, and refuses another one's folder") {
    const TemporaryFolder folder;
    const std::string command = "bench --scene projectile --scene slider --engines cairn --dt 1/60 --repeats 2 --out " + folder.path();
    REQUIRE(run_cairn(command).exit_code == 0);
    const std::string lines = read_text(folder.file("rows.jsonl"));
    REQUIRE(std::count(lines.begin(), lines.end(), '\n') == 7);  // the machine, four runs, and one a case with the clock on
    // Cut in the middle of the fourth run's line.
    std::size_t third = 0;
    for (int k = 0; k < 4; ++k) third = lines.find('\n', third) + 1;
    write_text(folder.file("rows.jsonl"), lines.substr(0, third + 20));
    REQUIRE(run_cairn(command).exit_code == 0);
    const std::string again = read_text(folder.file("rows.jsonl"));
    CHECK(std::count(again.begin(), again.end(), '\n') == 7);
    const nlohmann::json all = nlohmann::json::parse(read_text(folder.file("results.json")));
    for (const nlohmann::json& row : all.at("rows")) {
        CHECK(row.at("walls_s").size() == 2);
        CHECK(row.at("same_states") == true);
        double sum = 0;
        for (const nlohmann::json& phase : row.at("phases_s")) sum += phase.get<double>();
        CHECK(sum > 0);
    }
    std::string other = again;
    other.replace(other.find("\"commit\":\""), 10, "\"commit\":\"x");
    write_text(folder.file("rows.jsonl"), other);
    CHECK(run_cairn(command).exit_code == 2);
    CHECK(run_cairn(command + " --mixed").exit_code == 0);
}

TEST_CASE("the shards of a benchmark together are the undivided one: same rows in the same order, same errors and states") {
    const TemporaryFolder folder;
    const std::string command =
        "bench --scene bounce --scene slider --scene stack_5 --engines cairn --dt 1/60,1/120 --repeats 1 --no-profile ";
    REQUIRE(run_cairn(command + "--out " + folder.file("whole")).exit_code == 0);
    for (const char* shard : {"1", "2", "3", "4"})
        REQUIRE(run_cairn(command + "--shard " + shard + "/4 --out " + folder.file("parts/") + shard).exit_code == 0);
    std::vector<cairn::cli::Machine> one, four;
    const std::vector<cairn::cli::BenchRow> whole = cairn::cli::read_results(folder.file("whole"), one),
                                            parts = cairn::cli::read_results(folder.file("parts"), four);
    CHECK(four.size() == 4);
    REQUIRE(parts.size() == whole.size());
    for (std::size_t k = 0; k < whole.size(); ++k) {
        CHECK(parts[k].id == whole[k].id);
        CHECK(parts[k].error == whole[k].error);
        CHECK(parts[k].state_hash == whole[k].state_hash);
    }
}

TEST_CASE("over several steps the order of convergence is printed and kept") {
    const TemporaryFolder folder;
    const ProgramResult r = run_cairn(
        "bench --work-precision --filter pendulum --engines cairn --dt 1/60,1/120,1/240,1/480 --repeats 1 --out " + folder.path());
    CAPTURE(r.out, r.err);
    REQUIRE(r.exit_code == 0);
    // Jointed bodies are integrated with order 4; half of it is lost at most where the floor is near.
    const nlohmann::json orders = nlohmann::json::parse(read_text(folder.file("results.json"))).at("orders");
    CHECK(orders.size() == 3);  // pendulum, double_pendulum, rod_pendulum
    for (const nlohmann::json& o : orders) CHECK(o.at("order").get<double>() > 3.5);
    CHECK(r.out.find("order of convergence") != std::string::npos);
    CHECK(r.out.find(" over 1/60 … ") != std::string::npos);
    CHECK(read_text(folder.file("results.csv")).find(",threads,") != std::string::npos);
}

TEST_CASE("stress finds a limit, keeps its scenes, and a report is made of both") {
    const TemporaryFolder folder;
    REQUIRE(run_cairn("bench --scene projectile --engines cairn --dt 1/60 --repeats 1 --out " + folder.path()).exit_code == 0);
    const ProgramResult r = run_cairn("stress --quick --filter friction --engines cairn --out " + folder.path());
    CAPTURE(r.out, r.err);
    REQUIRE(r.exit_code == 0);
    const nlohmann::json limit = nlohmann::json::parse(read_text(folder.file("stress.json"))).at("limits").at(0);
    CHECK(limit.at("limit") == "friction");
    CHECK(limit.at("held").get<int>() >= 0);
    CHECK(!std::filesystem::is_empty(folder.file("scenes")));
    REQUIRE(run_cairn("report " + folder.path() + " --no-plots").exit_code == 0);
    CHECK(read_text(folder.file("report.html")).find("projectile") != std::string::npos);
    write_text(folder.file("page.md"),
               "before\n<!-- results: begin (cairn report --docs) -->\nstale table\n<!-- results: end -->\nafter\n");
    REQUIRE(run_cairn("report " + folder.path() + " --no-plots --docs " + folder.file("page.md")).exit_code == 0);
    const std::string page = read_text(folder.file("page.md"));
    CHECK(page.find("before\n") == 0);
    CHECK(page.find("stale table") == std::string::npos);
    CHECK(page.find("| projectile |") != std::string::npos);
    CHECK(page.substr(page.size() - 6) == "after\n");
    CHECK(run_cairn("report /dev/null").exit_code == 2);
    CHECK(run_cairn("stress --filter nonesuch").exit_code == 2);
}
