#include "apps/cli/diagnose/diagnose.hpp"

#include "engine/base/error.hpp"

#include <algorithm>
#include <limits>

namespace cairn::cli {

namespace {

// What the symptom is with the scene and the options as they are; nothing if they cannot be run.
std::optional<Real> run_again(const Symptom& symptom, const Scene& scene, const RunOptions& options) {
    const Evidence evidence = observe(scene, options);
    if (!evidence.refused.empty()) return std::nullopt;
    if (evidence.disabled_body != SIZE_MAX) return symptom.kind == SymptomKind::kBreaks ? 1 : std::numeric_limits<Real>::infinity();
    return measure_again(symptom, evidence);
}

// The deepest overlap of the body that was moved, at the start: of one step, since whatever follows is another matter.
std::optional<Real> overlap_again(const Symptom& symptom, const Scene& scene, const RunOptions& options) {
    Scene first = scene;
    first.duration = options.dt;
    const Evidence evidence = observe(first, options);
    if (!evidence.refused.empty()) return std::nullopt;
    Real depth = 0;
    for (const PairEvidence& p : evidence.pairs)
        if (p.a == symptom.index || p.b == symptom.index) depth = std::max(depth, p.start_depth);
    return depth;
}

}  // namespace

void try_cures(const Case& c, Finding& finding, const std::function<void(const std::string&)>& on_try) {
    if (!finding.symptom) return;
    for (const Cure& cure : finding.cures) {
        if (on_try) on_try(cure.says);
        Scene scene = c.scene;
        RunOptions options = c.options;
        cure.apply(scene, options);
        const Symptom& s = *finding.symptom;
        const std::optional<Real> after = finding.cause == "overlap" ? overlap_again(s, scene, options) : run_again(s, scene, options);
        if (!after) continue;
        finding.trials.push_back({cure.says, *after, *after < s.limit});
        if (finding.trials.back().cured) return;
    }
}

}  // namespace cairn::cli
