#include "apps/cli/bench/order.hpp"

#include "apps/cli/bench/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace cairn::cli {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeastSlope = 0.5;  // an error that falls more slowly than this is taken to stand
constexpr double kBend = 0.5;

using Points = std::vector<const BenchRow*>;

// Slope of log error over log dt of points [first, last).
double slope(const Points& points, std::size_t first, std::size_t last) {
    const double n = static_cast<double>(last - first);
    double x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t k = first; k < last; ++k) {
        const double u = std::log(points[k]->dt), v = std::log(points[k]->error);
        x += u;
        y += v;
        xx += u * u;
        xy += u * v;
    }
    return last - first < 2 ? kNone : (n * xy - x * y) / (n * xx - x * x);
}

// Whether each two neighbours have the slope of all within a tolerance.
bool is_straight(const Points& points, std::size_t first, std::size_t last) {
    const double all = slope(points, first, last);
    for (std::size_t k = first; k + 1 < last; ++k) {
        if (std::abs(slope(points, k, k + 2) - all) > kBend) return false;
    }
    return true;
}

bool falls(const BenchRow& coarse, const BenchRow& fine) {
    return fine.error <= coarse.error * std::pow(fine.dt / coarse.dt, kLeastSlope);
}

// First and number of the longest run of neighbouring points above the floor along which the error falls; of two as long the finer one. One
// that comes down from an error which coarser steps did not have is no convergence: such runs are left out.
std::pair<std::size_t, std::size_t> longest_fall(const Points& points) {
    std::size_t first = 0, count = 0;
    double least = std::numeric_limits<double>::infinity();  // of the points before k
    for (std::size_t k = 0; k < points.size(); ++k) {
        std::size_t end = k;
        while (end < points.size() && points[end]->error > kOrderFloor && (end == k || falls(*points[end - 1], *points[end]))) ++end;
        if (end > k && end - k >= count && points[k]->error <= 2 * least) {
            first = k;
            count = end - k;
        }
        least = std::min(least, points[k]->error);
    }
    return {first, count};
}

Order order_of_series(const std::string& series, const Points& points) {
    Order o;
    o.scene = points.front()->scene;
    o.label = label_of(*points.front());
    o.metric = points.front()->metric;
    o.series = series;
    o.order = o.overall = kNone;
    Points above;
    bool contacts = false;
    for (const BenchRow* p : points) {
        if (p->error > kOrderFloor) above.push_back(p);
        contacts = contacts || p->contacts != 0;
    }
    if (above.empty()) {
        o.note = "at the floor";
        return o;
    }
    o.overall = slope(above, 0, above.size());
    auto [first, count] = longest_fall(points);
    const std::size_t end = first + count;
    const bool to_floor = end < points.size() && points[end]->error <= kOrderFloor;
    if (count < 2 || (count == 2 && !to_floor)) {
        const bool near_floor = above.size() == 1 && to_floor;
        o.note = near_floor ? "at the floor but for one step"
                 : contacts ? "no order: the error does not fall (there are contacts)"
                            : "no order: the error does not fall";
        return o;
    }
    // Coarse steps that are not in the asymptotic part yet, if there is such a part; where the slope jitters all along, everything counts.
    for (std::size_t from = first; from + 3 <= end; ++from) {
        if (!is_straight(points, from, end)) continue;
        first = from;
        break;
    }
    o.order = slope(points, first, end);
    o.steps = static_cast<int>(end - first);
    o.coarsest = points[first]->dt_text;
    o.finest = points[end - 1]->dt_text;
    if (to_floor) o.note = "then at the floor";
    if (!to_floor && end < points.size()) o.note = fmt::format("then it stays: {:.1e} at {}", points.back()->error, points.back()->dt_text);
    return o;
}

}  // namespace

std::string series_of(const BenchRow& row) {
    return row.scene + " |" + id_without(row, "dt");
}

std::vector<Order> orders_of(const std::vector<BenchRow>& rows) {
    const std::vector<BenchRow> all = with_paths(rows);
    std::vector<std::string> order;
    std::map<std::string, Points> groups;
    for (const BenchRow& row : all) {
        if (row.truth == to_string(TruthKind::kInvariant)) continue;  // what is kept on any way tells nothing of the way
        if (row.status != "ok" || !std::isfinite(row.error) || !(row.dt > 0)) continue;
        const std::string series = series_of(row);
        if (groups.find(series) == groups.end()) order.push_back(series);
        groups[series].push_back(&row);
    }
    std::vector<Order> orders;
    for (const std::string& series : order) {
        Points& points = groups[series];
        std::stable_sort(points.begin(), points.end(), [](const BenchRow* a, const BenchRow* b) { return a->dt > b->dt; });
        if (points.size() >= 3) orders.push_back(order_of_series(series, points));
    }
    return orders;
}

std::string to_text(const Order& o) {
    if (!std::isfinite(o.order)) return o.note;
    return fmt::format("{:.1f} over {} … {}{}", o.order, o.coarsest, o.finest, o.note.empty() ? "" : ", " + o.note);
}

std::vector<BenchRow> with_paths(const std::vector<BenchRow>& rows) {
    std::vector<BenchRow> all = rows;
    for (const BenchRow& row : rows) {
        if (row.path_metric.empty()) continue;
        BenchRow path = row;
        path.scene += " path";  // a series of its own
        path.metric = row.path_metric;
        path.truth = to_string(TruthKind::kReference);
        path.unit = "1";
        path.error = row.path_error;
        all.push_back(std::move(path));
    }
    return all;
}

}  // namespace cairn::cli
