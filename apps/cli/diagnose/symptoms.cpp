#include "apps/cli/diagnose/diagnose.hpp"
#include "apps/cli/diagnose/limits.hpp"
#include "apps/cli/step_report_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace cairn::cli {

namespace {

int group_of_joint(const Scene& scene, const Evidence& e, std::size_t joint) {
    const SceneJoint& j = scene.joints[joint];
    for (const std::optional<std::size_t>& body : {j.body_a, j.body_b})
        if (body && e.bodies[*body].group >= 0) return e.bodies[*body].group;
    return -1;
}

// How far beyond its limit.
Real excess(const Symptom& s) {
    return s.value / s.limit;
}

Symptom of_pair(const Evidence& e, const PairEvidence& p) {
    const bool a_is_thinner = e.bodies[p.a].group >= 0 && (e.bodies[p.b].group < 0 || e.bodies[p.a].least <= e.bodies[p.b].least);
    Symptom s;
    s.kind = SymptomKind::kSinks;
    s.index = a_is_thinner ? p.a : p.b;
    s.other = a_is_thinner ? p.b : p.a;
    s.group = e.bodies[s.index].group;
    s.value = p.late_depth;
    s.limit = limits::kSink * std::min(e.bodies[p.a].least, e.bodies[p.b].least);
    return s;
}

}  // namespace

std::vector<Symptom> find_symptoms(const Scene& scene, const Evidence& e) {
    std::map<std::pair<int, SymptomKind>, Symptom> worst;
    const auto note = [&](const Symptom& s) {
        // Not: <=, which what is not a number would pass.
        if (s.value < s.limit) return;
        const auto [it, is_new] = worst.try_emplace({s.group, s.kind}, s);
        if (!is_new && excess(s) > excess(it->second)) it->second = s;
    };
    if (e.disabled_body != SIZE_MAX) note({SymptomKind::kBreaks, e.disabled_body, 0, e.bodies[e.disabled_body].group, 1, 1});
    for (std::size_t i = 0; i < e.bodies.size(); ++i) {
        const BodyEvidence& b = e.bodies[i];
        if (b.should_rest && b.radius > 0) note({SymptomKind::kMoves, i, 0, b.group, b.moved, limits::kMove * b.radius});
    }
    for (std::size_t k = 0; k < e.joints.size(); ++k) {
        const int group = group_of_joint(scene, e, k);
        if (e.joints[k].arm > 0) note({SymptomKind::kStretches, k, 0, group, e.joints[k].error, limits::kStretch * e.joints[k].arm});
        note({SymptomKind::kTwists, k, 0, group, e.joints[k].angle, limits::kTwist});
    }
    for (const PairEvidence& p : e.pairs) note(of_pair(e, p));
    std::vector<Symptom> symptoms;
    for (const auto& [key, s] : worst) symptoms.push_back(s);
    std::stable_sort(symptoms.begin(), symptoms.end(), [](const Symptom& a, const Symptom& b) { return excess(a) > excess(b); });
    return symptoms;
}

Real measure_again(const Symptom& s, const Evidence& e) {
    switch (s.kind) {
        case SymptomKind::kBreaks:
            return e.disabled_body == SIZE_MAX ? 0 : 1;
        case SymptomKind::kMoves:
            return e.bodies[s.index].moved;
        case SymptomKind::kStretches:
            return e.joints[s.index].error;
        case SymptomKind::kTwists:
            return e.joints[s.index].angle;
        case SymptomKind::kSinks:
            break;
    }
    Real depth = 0;
    for (const PairEvidence& p : e.pairs)
        if ((p.a == s.index && p.b == s.other) || (p.b == s.index && p.a == s.other)) depth = std::max(depth, p.late_depth);
    return depth;
}

std::string number_text(const Symptom& s, Real value) {
    if (s.kind == SymptomKind::kBreaks) return value > 0 ? "broken" : "whole";
    return fmt::format("{:.3g} {}", value, s.kind == SymptomKind::kTwists ? "rad" : "m");
}

std::string symptom_text(const Symptom& s, const Scene& scene) {
    const auto joint = [&] { return "the " + joint_name(scene, {static_cast<std::uint32_t>(s.index), 0}); };
    const auto body = [&](std::size_t i) { return scene.bodies[i].name; };
    const std::string value = number_text(s, s.value);
    switch (s.kind) {
        case SymptomKind::kBreaks:
            return fmt::format("{} goes non-finite", body(s.index));
        case SymptomKind::kMoves:
            return s.value > limits::kFall / limits::kMove * s.limit
                       ? fmt::format("{} should rest, but falls: it moves {}", body(s.index), value)
                       : fmt::format("{} should rest, but creeps {}", body(s.index), value);
        case SymptomKind::kStretches:
            return fmt::format("{} stretches by {}", joint(), value);
        case SymptomKind::kTwists:
            return fmt::format("{} twists by {}", joint(), value);
        case SymptomKind::kSinks:
            break;
    }
    return fmt::format("{} stays {} deep in {}", body(s.index), value, body(s.other));
}

}  // namespace cairn::cli
