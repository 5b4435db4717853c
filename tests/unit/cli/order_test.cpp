// Orders of convergence and what a report makes of them.
#include "apps/cli/bench/order.hpp"
#include "apps/cli/bench/verdict.hpp"
#include "apps/cli/html/page.hpp"
#include "apps/cli/html/plots.hpp"
#include "apps/cli/profile.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <cmath>

using namespace cairn;
using namespace cairn::cli;

namespace {

// Steps of 1/30 and its halves with these errors.
std::vector<BenchRow> series(const std::vector<double>& errors, int contacts = 0) {
    std::vector<BenchRow> rows;
    for (std::size_t k = 0; k < errors.size(); ++k) {
        BenchRow r;
        r.scene = "s";
        r.engine = "cairn";
        r.status = "ok";
        r.truth = "closed form";
        r.metric = "position";
        const int per_second = 30 << k;
        r.dt = 1.0 / per_second;
        r.dt_text = fmt::format("1/{}", per_second);
        r.id = fmt::format("s cairn dt={} substeps=default", r.dt_text);
        r.error = errors[k];
        r.path_error = std::nan("");
        r.contacts = contacts;
        r.walls = r.step_medians = {1e-3};
        r.steps = 1;
        rows.push_back(r);
    }
    return rows;
}

Order only(const std::vector<BenchRow>& rows) {
    const std::vector<Order> orders = orders_of(rows);
    REQUIRE(orders.size() == 1);
    return orders.front();
}

}  // namespace

TEST_CASE("an error that falls as a power of the step has that power as its order") {
    for (const double p : {1.0, 2.0, 4.0}) {
        std::vector<double> errors;
        for (int k = 0; k < 5; ++k) errors.push_back(0.3 * std::pow(2.0, -p * k));
        const Order o = only(series(errors));
        CHECK(o.order == Approx(p).epsilon(1e-12));
        CHECK(o.overall == Approx(p).epsilon(1e-12));
        CHECK(o.steps == 5);
        CHECK(to_text(o) == fmt::format("{:.1f} over 1/30 … 1/480", p));
    }
}

TEST_CASE("an order is measured above the floor and in the asymptotic part, and it is told what is beyond") {
    // A flat start, then fourth order, then rounding.
    const Order fourth = only(series({1e-4, 0.9e-4, 0.9e-4 / 16, 0.9e-4 / 256, 0.9e-4 / 4096, 3e-12, 5e-11}));
    CHECK(fourth.order == Approx(4).epsilon(1e-12));
    CHECK(to_text(fourth) == "4.0 over 1/60 … 1/480, then at the floor");
    // Second order until something else than the step makes the error. Over all five steps the slope is less.
    const Order second = only(series({1.6e-4, 0.4e-4, 1e-5, 1e-5, 1e-5}));
    CHECK(second.order == Approx(2).epsilon(1e-12));
    CHECK(second.overall < 1.5);
    CHECK(to_text(second) == "2.0 over 1/30 … 1/120, then it stays: 1.0e-05 at 1/480");
}

TEST_CASE("what is at the floor, jumps or fails has no order") {
    CHECK(to_text(only(series({1e-15, 1e-14, 1e-15}))) == "at the floor");
    CHECK(to_text(only(series({1e-3, 1.1e-3, 0.9e-3, 1e-3}, 4))) == "no order: the error does not fall (there are contacts)");
    CHECK(to_text(only(series({1e-3, 1.1e-3, 0.9e-3, 1e-3}))) == "no order: the error does not fall");
    // An error that coarser steps did not have comes down again: no convergence.
    CHECK(!std::isfinite(only(series({1e-9, 1e-8, 1e-2, 1e-4, 1e-6}, 4)).order));
    std::vector<BenchRow> failed = series({1e-2, 1e-3, 1e-4});
    failed[1].status = "failed";
    CHECK(orders_of(failed).empty());
    std::vector<BenchRow> invariant = series({1e-2, 1e-3, 1e-4});
    for (BenchRow& r : invariant) r.truth = "invariant";
    CHECK(orders_of(invariant).empty());
}

TEST_CASE("a series is of one choice of everything but the step") {
    std::vector<BenchRow> rows = series({1e-2, 1e-3, 1e-4});
    for (BenchRow r : series({1e-2, 1e-3, 1e-4})) {
        r.threads = 2;
        r.id += " threads=2";
        rows.push_back(r);
    }
    CHECK(orders_of(rows).size() == 2);
    rows.resize(5);
    CHECK(orders_of(rows).size() == 1);
    CHECK(id_without(rows[4], "threads") == rows[1].id);
}

TEST_CASE("where a truth is an invariant, the order is that of the path") {
    std::vector<BenchRow> rows = series({1e-3, 1e-3, 1e-3});
    for (std::size_t k = 0; k < rows.size(); ++k) {
        rows[k].truth = "invariant";
        rows[k].path_metric = "path";
        rows[k].path_error = std::pow(8.0, -static_cast<double>(k));
    }
    const Order o = only(rows);
    CHECK(o.scene == "s path");
    CHECK(o.order == Approx(3).epsilon(1e-12));
}

TEST_CASE("the page shows orders, threads and the stages of steps") {
    ReportData data;
    data.rows = series({1e-2, 1e-2 / 16, 1e-2 / 256});
    data.drawings["scene-s"] = "<svg></svg>";
    data.rows[1].phases.assign(phase_keys().size(), 1e-4);
    BenchRow two = data.rows[1];
    two.threads = 2;
    two.id += " threads=2";
    two.walls = {0.5e-3};
    CHECK(threads_script(data.rows).empty());
    data.rows.push_back(two);
    const std::string page = report_page(data);
    CHECK(page.find("<figcaption><div><b>cairn</b> order 4.0 over 1/30 … 1/120</div></figcaption>") != std::string::npos);
    CHECK(page.find("narrow phase: 11 %, 100.0 µs") != std::string::npos);
    CHECK(page.find("<b>s, 2 threads</b>") != std::string::npos);
    CHECK(threads_script(data.rows).find("1 1\n2 2\n") != std::string::npos);
    CHECK(report_markdown(data, "").find("| s | cairn | 4.0 over 1/30 … 1/120 | position |") != std::string::npos);
}

TEST_CASE("another engine leads where it is as accurate in less time than Cairn's line needs") {
    std::vector<BenchRow> rows = series({1e-2, 1e-4, 1e-6});
    for (std::size_t k = 0; k < 3; ++k) rows[k].walls = {1e-3 * std::pow(10.0, static_cast<double>(k))};
    const auto other = [&rows](double wall, double error) {
        std::vector<BenchRow> all = rows;
        for (BenchRow r : rows) {
            r.engine = "other";
            r.id.replace(2, 5, "other");
            r.error = error;
            r.walls = {wall};
            all.push_back(r);
        }
        return leads_of_others(all, "s");
    };
    // Halfway between the logarithms of two points, 1e-3 takes √10 ms.
    CHECK(other(1.01e-3 * std::sqrt(10.0), 1e-3).empty());
    REQUIRE(other(0.5e-3 * std::sqrt(10.0), 1e-3).size() == 3);
    CHECK(other(0.5e-3 * std::sqrt(10.0), 1e-3)[0].factor == Approx(2));
    CHECK(!other(0.5e-3 * std::sqrt(10.0), 1e-3)[0].cheapest);
    CHECK(other(0.5e-3, 1)[0].cheapest);
    CHECK(!std::isfinite(other(1, 1e-8)[0].factor));
    // Below the floor all errors are one.
    for (BenchRow& r : rows) r.error *= 1e-4;
    CHECK(other(0.2, 1e-14).empty());
}
