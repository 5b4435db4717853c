#include "apps/cli/bench/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
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

std::string id_without(const BenchRow& row, const std::string& key) {
    std::string id = row.id;
    const std::size_t at = id.find(' ' + key + '=');
    if (at != std::string::npos) id.erase(at, std::min(id.find(' ', at + 1), id.size()) - at);
    return id;
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

namespace {

using Curve = std::vector<const BenchRow*>;  // coarse steps first

std::map<std::string, Curve> curves_of(const std::vector<BenchRow>& rows, const std::string& scene, bool of_cairn) {
    std::map<std::string, Curve> curves;
    for (const BenchRow& r : rows) {
        if (r.scene == scene && counts(r) && (r.engine == "cairn") == of_cairn) curves[id_without(r, "dt")].push_back(&r);
    }
    for (auto& [name, curve] : curves)
        std::stable_sort(curve.begin(), curve.end(), [](const BenchRow* a, const BenchRow* b) { return a->dt > b->dt; });
    return curves;
}

double seen(const BenchRow& r) {
    return std::max(r.error, kRounding);
}

// The least time in which the curve reaches an error, between two of its points along the line through their logarithms.
double time_to(const Curve& curve, double error) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < curve.size(); ++k) {
        if (seen(*curve[k]) <= error) least = std::min(least, curve[k]->wall_median());
        if (k == 0 || !(seen(*curve[k - 1]) > error && seen(*curve[k]) <= error)) continue;
        const double e0 = std::log(seen(*curve[k - 1])), e1 = std::log(seen(*curve[k]));
        const double t0 = std::log(curve[k - 1]->wall_median()), t1 = std::log(curve[k]->wall_median());
        least = std::min(least, std::exp(t0 + (std::log(error) - e0) / (e1 - e0) * (t1 - t0)));
    }
    return least;
}

}  // namespace

std::vector<Lead> leads_of_others(const std::vector<BenchRow>& rows, const std::string& scene) {
    const std::map<std::string, Curve> own = curves_of(rows, scene, true);
    std::vector<Lead> leads;
    if (own.empty()) return leads;
    double quickest = std::numeric_limits<double>::infinity();
    for (const auto& [name, curve] : own) {
        for (const BenchRow* r : curve) quickest = std::min(quickest, r->wall_median());
    }
    for (const auto& [name, curve] : curves_of(rows, scene, false)) {
        for (const BenchRow* r : curve) {
            double time = std::numeric_limits<double>::infinity();
            for (const auto& [own_name, own_curve] : own) time = std::min(time, time_to(own_curve, seen(*r)));
            if (time > r->wall_median()) leads.push_back({r, time / r->wall_median(), r->wall_median() < quickest && std::isfinite(time)});
        }
    }
    std::stable_sort(leads.begin(), leads.end(), [](const Lead& a, const Lead& b) { return a.row->wall_median() < b.row->wall_median(); });
    return leads;
}

std::vector<std::string> curves_compared(const std::vector<BenchRow>& rows) {
    std::vector<std::string> sentences;
    for (const std::string& scene : scenes_of(rows)) {
        const auto is_curve = [](const auto& curve) { return curve.second.size() >= 3; };
        const std::map<std::string, Curve> own = curves_of(rows, scene, true), others = curves_of(rows, scene, false);
        if (!std::any_of(own.begin(), own.end(), is_curve) || !std::any_of(others.begin(), others.end(), is_curve)) continue;
        std::string under;
        std::map<std::string, std::vector<Lead>> quicker;
        for (const Lead& lead : leads_of_others(rows, scene)) {
            if (lead.cheapest) {
                quicker[label_of(*lead.row)].push_back(lead);
                continue;
            }
            const std::string by =
                std::isfinite(lead.factor) ? fmt::format("{:.1f} times sooner", lead.factor) : "which Cairn does not reach";
            under += fmt::format("{}{} at {} ({:.1e}, {})", under.empty() ? "" : ", ", label_of(*lead.row), lead.row->dt_text,
                                 lead.row->error, by);
        }
        std::string text = scene + ": ";
        text += under.empty() ? "no curve of error over time lies under Cairn's" : "under Cairn's curve of error over time: " + under;
        std::string list;
        for (const auto& [engine, runs] : quicker) {
            double most = 0, least = std::numeric_limits<double>::infinity();
            for (const Lead& lead : runs) {
                most = std::max(most, lead.factor);
                least = std::min(least, lead.row->error);
            }
            list += fmt::format("{}{} (up to {:.1f} times, errors of {:.1e} and more)", list.empty() ? "" : ", ", engine, most, least);
        }
        if (!list.empty()) text += "; left of its first point: " + list;
        sentences.push_back(text);
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
