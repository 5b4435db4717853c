#include "apps/cli/html/phases.hpp"

#include "apps/cli/html/page.hpp"
#include "apps/cli/profile.hpp"
#include "apps/cli/report.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::cli {

namespace {

// In the order of phase_keys().
constexpr const char* kColours[] = {"#0f9d6b", "#1f77d4", "#5aa9c8", "#b08a00", "#e66100", "#c4498a", "#7d6bd0", "#9a6b4f", "#8a8a8a"};

std::string phase_name(std::size_t k) {
    std::string name = phase_keys()[k];
    std::replace(name.begin(), name.end(), '_', ' ');
    return name;
}

bool is_shown(const BenchRow& r) {
    const bool defaults = r.substeps == 0 && r.iterations == 0 && (r.solver.empty() || r.solver == "auto");
    return r.phases.size() == phase_keys().size() && r.dt_text == "1/60" && defaults && r.steps > 0;
}

}  // namespace

std::string phase_bars(const std::vector<BenchRow>& rows) {
    std::string bars;
    for (const BenchRow& r : rows) {
        if (!is_shown(r)) continue;
        double sum = 0;
        for (const double s : r.phases) sum += s;
        if (!(sum > 0)) continue;
        std::string parts;
        for (std::size_t k = 0; k < r.phases.size(); ++k) {
            const double share = 100 * r.phases[k] / sum, step = r.phases[k] / static_cast<double>(r.steps);
            if (share < 0.05) continue;
            parts += fmt::format("<i style=\"width:{:.1f}%;background:{}\" title=\"{}: {:.0f} %, {}\"></i>", share, kColours[k],
                                 phase_name(k), share, readable_time(step));
        }
        const std::string threads = r.threads == 1 ? "" : fmt::format(", {} threads", r.threads);
        bars += fmt::format("<div><b>{}{}</b><span class=\"bar\">{}</span><span>{}</span></div>\n", escaped(r.scene), threads, parts,
                            readable_time(sum / static_cast<double>(r.steps)));
    }
    if (bars.empty()) return {};
    std::string legend;
    for (std::size_t k = 0; k < phase_keys().size(); ++k) {
        legend += fmt::format("<span><i style=\"background:{}\"></i>{}</span> ", kColours[k], phase_name(k));
    }
    return "<p class=\"legend\">" + legend + "</p>\n<div class=\"phases\">\n" + bars + "</div>\n";
}

}  // namespace cairn::cli
