#include "apps/cli/bench/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace cairn::cli {

namespace {

bool counts(const BenchRow& row) {
    return row.status == "ok" && std::isfinite(row.error) && row.wall_median() > 0;
}

// Errors below this are rounding: a millionth of a millimetre, or of the whole.
constexpr double kRounding = 1e-9;

template <typename Name>
std::vector<std::string> distinct(const std::vector<BenchRow>& rows, Name name) {
    std::vector<std::string> list;
    for (const BenchRow& row : rows) {
        if (std::find(list.begin(), list.end(), name(row)) == list.end()) list.push_back(name(row));
    }
    return list;
}

}  // namespace

std::string label_of(const BenchRow& row) {
    std::string label = row.solver.empty() || row.solver == "auto" ? row.engine : row.engine + " " + row.solver;
    if (row.threads != 1) label += fmt::format(" {} threads", row.threads);
    return label;
}

std::vector<std::string> scenes_of(const std::vector<BenchRow>& rows) {
    return distinct(rows, [](const BenchRow& r) { return r.scene; });
}

std::vector<std::string> labels_of(const std::vector<BenchRow>& rows) {
    return distinct(rows, label_of);
}

std::vector<std::string> wins_of_others(const std::vector<BenchRow>& rows) {
    std::map<std::string, std::vector<std::string>> wins;
    for (const BenchRow& r : rows) {
        if (r.engine == "cairn" || !counts(r)) continue;
        bool met = false, beats_all = true;
        for (const BenchRow& own : rows) {
            if (own.engine != "cairn" || own.scene != r.scene || own.dt_text != r.dt_text || own.status == "unsupported") continue;
            met = true;
            const bool no_less_accurate = r.error <= std::max(own.error, kRounding);
            beats_all = beats_all && (own.status != "ok" || (no_less_accurate && r.wall_median() < own.wall_median()));
        }
        if (met && beats_all) wins[r.engine].push_back(fmt::format("{} ({})", r.scene, r.dt_text));
    }
    std::vector<std::string> sentences;
    for (const auto& [engine, where] : wins) {
        sentences.push_back(
            fmt::format("{} is faster and no less accurate than Cairn at the same step in: {}", engine, fmt::join(where, ", ")));
    }
    return sentences;
}

std::vector<std::string> faster_others(const std::vector<BenchRow>& rows) {
    struct Tally {
        int faster = 0, met = 0;
    };
    std::map<std::string, Tally> tallies;
    for (const BenchRow& r : rows) {
        if (r.engine == "cairn" || !counts(r)) continue;
        const BenchRow* own = nullptr;
        for (const BenchRow& c : rows) {
            if (c.engine != "cairn" || c.scene != r.scene || c.dt_text != r.dt_text || !counts(c)) continue;
            if (own == nullptr || c.wall_median() < own->wall_median()) own = &c;
        }
        if (own == nullptr) continue;
        ++tallies[r.engine].met;
        tallies[r.engine].faster += r.wall_median() < own->wall_median() ? 1 : 0;
    }
    std::vector<std::string> sentences;
    for (const auto& [engine, tally] : tallies) {
        sentences.push_back(
            fmt::format("{} takes less time than Cairn at the same step, at whatever error, in {} of the {} cases that both pass", engine,
                        tally.faster, tally.met));
    }
    return sentences;
}

std::vector<const BenchRow*> pareto_front(const std::vector<BenchRow>& rows, const std::string& scene) {
    std::vector<const BenchRow*> sorted;
    for (const BenchRow& row : rows) {
        if (row.scene == scene && counts(row)) sorted.push_back(&row);
    }
    std::stable_sort(sorted.begin(), sorted.end(), [](const BenchRow* a, const BenchRow* b) {
        return std::pair(a->wall_median(), a->error) < std::pair(b->wall_median(), b->error);
    });
    std::vector<const BenchRow*> front;
    for (const BenchRow* row : sorted) {
        if (front.empty() || std::max(row->error, kRounding) < std::max(front.back()->error, kRounding)) front.push_back(row);
    }
    return front;
}

std::vector<std::pair<std::string, int>> front_counts(const std::vector<BenchRow>& rows) {
    std::map<std::string, int> counts_of;
    for (const std::string& label : labels_of(rows)) counts_of[label] = 0;
    for (const std::string& scene : scenes_of(rows)) {
        std::set<std::string> on_front;
        for (const BenchRow* row : pareto_front(rows, scene)) on_front.insert(label_of(*row));
        for (const std::string& label : on_front) ++counts_of[label];
    }
    std::vector<std::pair<std::string, int>> list(counts_of.begin(), counts_of.end());
    std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    return list;
}

}  // namespace cairn::cli
