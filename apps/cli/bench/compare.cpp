#include "apps/cli/bench/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace cairn::cli {

namespace {

// The one row of the same scene, engine and step, whatever its other settings; null if there is none or there are several.
const BenchRow* only_like(const std::vector<BenchRow>& rows, const BenchRow& wanted) {
    const BenchRow* found = nullptr;
    for (const BenchRow& row : rows) {
        if (row.scene != wanted.scene || row.engine != wanted.engine || row.dt_text != wanted.dt_text) continue;
        if (found != nullptr) return nullptr;
        found = &row;
    }
    return found;
}

}  // namespace

Comparison compare_results(const std::vector<BenchRow>& before, const std::vector<BenchRow>& now, const CompareLimits& limits) {
    std::map<std::string, const BenchRow*> old;
    for (const BenchRow& row : before) old[row.id] = &row;
    Comparison result;
    for (const BenchRow& row : now) {
        const auto found = old.find(row.id);
        const BenchRow* other = found == old.end() ? only_like(before, row) : found->second;
        if (other == nullptr) continue;
        const BenchRow& was = *other;
        ++result.compared;
        result.other_settings += found == old.end() ? 1 : 0;
        if (row.status != was.status) {
            const std::string change = fmt::format("{}: {} (was {}) {}", row.id, row.status, was.status, row.note);
            (row.status == "ok" ? result.better : result.worse).push_back(change);
            continue;
        }
        const double slack = std::max(limits.accuracy * was.error, limits.floor);
        const std::string change = fmt::format("{}: {} {:.4g} (was {:.4g}) {}", row.id, row.metric, row.error, was.error, row.unit);
        if (std::isfinite(was.error) && !(row.error <= was.error + slack)) result.worse.push_back(change);
        if (std::isfinite(row.error) && row.error < was.error - slack) result.better.push_back(change);
        if (row.instructions > 0 && was.instructions > 0) {
            if (row.instructions > (1 + limits.instructions) * was.instructions) {
                result.slower.push_back(fmt::format("{}: {:.4g} instructions (was {:.4g})", row.id, row.instructions, was.instructions));
            }
            continue;
        }
        const double noise = std::max(limits.time, row.spread() + was.spread());
        if (was.wall_median() > 0 && row.wall_median() > (1 + noise) * was.wall_median()) {
            result.slower.push_back(fmt::format("{}: {:.3g} s (was {:.3g} s, spreads {:.0f} % and {:.0f} %)", row.id, row.wall_median(),
                                                was.wall_median(), 100 * row.spread(), 100 * was.spread()));
        }
    }
    return result;
}

}  // namespace cairn::cli
