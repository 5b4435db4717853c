#include "apps/cli/bench/compare.hpp"
#include "apps/cli/bench/verdict.hpp"
#include "apps/cli/html/page.hpp"
#include "apps/cli/stress/search.hpp"
#include "engine/base/error.hpp"
#include "tests/support/catch.hpp"

#include <set>

using namespace cairn;
using namespace cairn::cli;

namespace {

BenchRow row(const std::string& engine, double wall, double error, const std::string& scene = "s") {
    BenchRow r;
    r.scene = scene;
    r.engine = engine;
    r.dt_text = "1/60";
    r.id = scene + " " + engine;
    r.status = "ok";
    r.metric = "drift";
    r.unit = "m";
    r.error = error;
    r.walls = {wall};
    r.step_medians = {wall};
    return r;
}

}  // namespace

TEST_CASE("a plan crosses what is asked for, and shards share it without overlap") {
    BenchRequest r;
    r.scenes = {"projectile", "stack_5"};
    r.engines = "cairn";
    r.dt = "1/60,0.01";
    r.substeps = "1,4,default";
    r.solvers = "auto,si";
    const std::vector<BenchCase> all = plan_cases(r);
    CHECK(all.size() == 2 * 2 * 3 * 2);
    std::set<std::string> ids;
    for (const BenchCase& c : all) ids.insert(c.id());
    CHECK(ids.size() == all.size());
    std::set<std::string> from_shards;
    std::size_t count = 0;
    for (const char* shard : {"1/3", "2/3", "3/3"}) {
        r.shard = shard;
        for (const BenchCase& c : plan_cases(r)) {
            from_shards.insert(c.id());
            ++count;
        }
    }
    CHECK(count == all.size());
    CHECK(from_shards == ids);
    for (const char* bad : {"0/3", "4/3", "x", "1/", "1/2x"}) {
        r.shard = bad;
        CHECK_THROWS_AS(plan_cases(r), Error);
    }
    r.shard = "";
    r.substeps = "0";
    CHECK_THROWS_AS(plan_cases(r), Error);
}

TEST_CASE("the set for work against precision has its scenes and seven halved steps; threads are crossed for Cairn alone") {
    BenchRequest r;
    r.work_precision = true;
    r.engines = "cairn";
    std::set<std::string> scenes, steps;
    for (const BenchCase& c : plan_cases(r)) {
        scenes.insert(c.file->scene.name);
        steps.insert(c.dt);
    }
    for (const char* name : {"torque_free", "top", "pendulum", "double_pendulum", "chain_10", "slide_stop", "tip", "bounce", "stack_20"})
        CHECK(scenes.count(name) == 1);
    CHECK(scenes.count("pile_100") == 0);
    CHECK(steps.size() == 7);
    r.filter = "tip";
    r.dt = "1/60";
    r.threads = "1,2";
    r.external = {"other=/bin/true"};
    CHECK(plan_cases(r).size() == 2 + 1);
    r.threads = "0";
    CHECK_THROWS_AS(plan_cases(r), Error);
}

TEST_CASE("a case's command names its engine, step and solver") {
    BenchRequest r;
    r.scenes = {"stack_5"};
    r.engines = "cairn";
    r.dt = "1/90";
    r.solvers = "si";
    r.iterations = "7";
    const std::string command = plan_cases(r).front().command();
    CHECK(command == "cairn bench --scene stack_5 --dt 1/90 --engines cairn --solver si --iterations 7");
}

TEST_CASE("an external program's command repeats its run alone") {
    BenchRequest r;
    r.scenes = {"stack_5"};
    r.engines = "none";
    r.external = {"other=/bin/true"};
    r.dt = "1/90";
    const std::vector<BenchCase> cases = plan_cases(r);
    REQUIRE(cases.size() == 1);
    CHECK(cases.front().command() == "cairn bench --scene stack_5 --dt 1/90 --engines none --engine other=/bin/true");
    r.external.clear();
    CHECK_THROWS_AS(plan_cases(r), Error);
}

TEST_CASE("the Pareto front holds what nothing beats in both time and error") {
    const std::vector<BenchRow> rows = {row("cairn", 2, 0.1), row("a", 1, 0.5), row("b", 3, 0.2), row("c", 4, 0.01), row("d", 0.5, 0.9)};
    std::vector<std::string> names;
    for (const BenchRow* r : pareto_front(rows, "s")) names.push_back(r->engine);
    CHECK(names == std::vector<std::string>{"d", "a", "cairn", "c"});
    CHECK(front_counts(rows).back() == std::pair<std::string, int>("b", 0));
}

TEST_CASE("a win of another engine is told: faster and no less accurate, or right where Cairn fails") {
    std::vector<BenchRow> rows = {row("cairn", 2, 0.1), row("other", 1, 0.1)};
    REQUIRE(wins_of_others(rows).size() == 1);
    rows[1].error = 0.2;
    CHECK(wins_of_others(rows).empty());
    rows[0].status = "failed";
    CHECK(wins_of_others(rows).size() == 1);
    rows[1].status = "failed";
    CHECK(wins_of_others(rows).empty());
}

TEST_CASE("what is faster at whatever error is counted") {
    const std::vector<BenchRow> rows = {row("cairn", 2, 0.1, "s"), row("a", 1, 9, "s"), row("cairn", 2, 0.1, "t"), row("a", 3, 9, "t")};
    REQUIRE(faster_others(rows).size() == 1);
    CHECK(faster_others(rows).front().find("in 1 of the 2 cases") != std::string::npos);
}

TEST_CASE("a comparison finds what got less accurate, fails anew or is slower beyond the noise") {
    const std::vector<BenchRow> before = {row("cairn", 1, 0.1), row("b", 1, 1e-15), row("c", 1, 0.1), row("d", 1, 0.1)};
    std::vector<BenchRow> now = before;
    now[0].error = 0.104;  // within 5 %
    now[1].error = 1e-10;  // below the floor
    CHECK(compare_results(before, now, {}).worse.empty());
    now[0].error = 0.106;
    now[2].status = "failed";
    now[3].error = 0.05;
    now[3].walls = {1.2};
    const Comparison c = compare_results(before, now, {});
    CHECK(c.compared == 4);
    CHECK(c.worse.size() == 2);
    CHECK(c.better.size() == 1);
    CHECK(c.slower.size() == 1);
    now[3].walls = {1.2, 0.9};  // spread 0.3 / 1.05: no more than noise
    CHECK(compare_results(before, now, {}).slower.empty());
}

TEST_CASE("a case with other settings is compared with the only one of its scene, engine and step; instructions come before times") {
    const std::vector<BenchRow> before = {row("cairn", 1, 0.1), row("b", 1, 0.1)};
    std::vector<BenchRow> now = before;
    now[0].id += " substeps=8";
    now[0].walls = {2};
    CHECK(compare_results(before, now, {}).compared == 2);
    CHECK(compare_results(before, now, {}).other_settings == 1);
    CHECK(compare_results(before, now, {}).slower.size() == 1);
    std::vector<BenchRow> counted = before;
    counted[0].instructions = 1000;
    now[0].instructions = 1015;  // within 2 %, whatever the time
    CHECK(compare_results(counted, now, {}).slower.empty());
    now[0].instructions = 1025;
    REQUIRE(compare_results(counted, now, {}).slower.size() == 1);
    CHECK(compare_results(counted, now, {}).slower[0].find("1025 instructions (was 1000)") != std::string::npos);
    counted.push_back(counted[0]);
    counted[2].id += " substeps=1";
    CHECK(compare_results(counted, now, {}).compared == 1);  // of two, neither
    now[0].dt_text = "1/61";
    CHECK(compare_results(before, now, {}).compared == 1);
}

TEST_CASE("the bisection finds the highest rung that holds, and why the next does not") {
    for (int limit = -1; limit < 12; ++limit) {
        int asked = 0;
        std::string reason;
        const auto passes = [&](int k) {
            ++asked;
            return k <= limit ? std::string() : "rung " + std::to_string(k);
        };
        CHECK(highest_passing(12, passes, reason) == std::min(limit, 11));
        CHECK(reason == (limit < 11 ? "rung " + std::to_string(limit + 1) : ""));
        CHECK(asked <= 4);
    }
}

TEST_CASE("every limit's scenes can be read from the first rung to the last, and get no easier") {
    for (const Limit& limit : all_limits()) {
        CAPTURE(limit.name);
        REQUIRE(limit.rungs.size() >= 5);
        for (const std::size_t k : {std::size_t(0), limit.rungs.size() - 1}) {
            const Scene scene = parse_scene(limit.scene(limit.rungs[k], true), limit.name);
            CHECK(!scene.bodies.empty());
        }
    }
}

TEST_CASE("the page holds its rows, escapes what it is given and needs no network") {
    ReportData data;
    data.rows = {row("cairn", 2, 0.1), row("<other>", 1, 0.1)};
    data.machines.push_back({"a & b", 2, "system", "compiler", "flags", "abc", "today"});
    const std::string page = report_page(data);
    CHECK(page.find("&lt;other&gt; is faster and no less accurate") != std::string::npos);
    CHECK(page.find("<other>") == std::string::npos);
    CHECK(page.find("a &amp; b") != std::string::npos);
    CHECK(page.find("src=") == std::string::npos);
    CHECK(page.find("http") == std::string::npos);
    CHECK(report_markdown(data, "").find("| s | drift [m] |") != std::string::npos);
}
