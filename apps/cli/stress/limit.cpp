#include "apps/cli/stress/limit.hpp"

#include "apps/cli/truth_parts.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

std::vector<Limit> all_limits() {
    std::vector<Limit> all;
    for (const auto family :
         {stack_limits, ratio_limits, joint_limits, structure_limits, material_limits, size_limits, speed_limits, driven_limits}) {
        for (Limit& limit : family()) all.push_back(std::move(limit));
    }
    return all;
}

std::vector<double> ladder(double first, double last, int count, bool whole) {
    std::vector<double> rungs;
    for (int k = 0; k < count; ++k) {
        double rung = first * std::pow(last / first, static_cast<double>(k) / (count - 1));
        // Two digits are enough for a rung, and make a readable one.
        const double unit = std::pow(10.0, std::floor(std::log10(rung)) - 1);
        rung = whole ? std::round(rung) : std::round(rung / unit) * unit;
        if (rungs.empty() || rungs.back() != rung) rungs.push_back(rung);
    }
    return rungs;
}

std::string moved_more_than(const Scene& scene, const EngineRun& run, Real limit) {
    const TruthError drift = at_rest(scene, run.history);
    if (!drift.failed.empty()) return drift.failed;
    return drift.value <= limit ? std::string() : fmt::format("moved {:.3g} m", drift.value);
}

std::string stretched_more_than(const Scene& scene, const EngineRun& run, Real limit) {
    const TruthError stretch = chain_stretch(scene, run.history);
    return stretch.value <= limit ? std::string() : fmt::format("stretched by {:.3g} %", 100 * stretch.value);
}

}  // namespace cairn::cli
