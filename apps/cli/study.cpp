#include "apps/cli/study.hpp"

#include <fmt/format.h>

#include <cmath>

namespace cairn::cli {

void StudyReport::say(const std::string& paragraph) {
    blocks.push_back({StudyBlock::kProse, prose.size()});
    prose.push_back(paragraph);
}

StudyTable& StudyReport::table(const std::string& name, const std::string& caption, const std::vector<std::string>& columns) {
    blocks.push_back({StudyBlock::kTable, tables.size()});
    tables.push_back({name, caption, columns, {}});
    return tables.back();
}

StudyFigure& StudyReport::figure(const std::string& name, const std::string& caption, const std::string& commands) {
    blocks.push_back({StudyBlock::kFigure, figures.size()});
    figures.push_back({name, caption, commands, {}});
    return figures.back();
}

void StudyReport::conclude(const std::string& sentence) {
    verdict = sentence;
}

std::string number(Real x) {
    if (!std::isfinite(x)) return "not a number";
    return std::abs(x) < 1e-15 ? "0" : fmt::format("{:.3g}", x);
}

const std::vector<StudyTopic>& study_topics() {
    static const std::vector<StudyTopic> topics = {
        {"1a", "The non-penetration constraint",
         "Why does C_N = nᵀ(r₁ − r₂) ≥ 0 prevent penetration, and what does a force along the surface do?", study_constraint},
        {"1b", "The velocity map", "What is G_N, starting from the ball joint's G_B?", study_velocity_map},
        {"1c", "M⁻¹Gᵀλ and S", "What are M⁻¹Gᵀλ and S = G M⁻¹Gᵀ in closed form, and is the code that?", study_masses},
        {"1lcp", "Complementarity, two thought experiments", "What happens without λ ≥ 0, and what without λ C = 0?",
         study_complementarity},
        {"1d", "Per-iteration clamp", "What does it do to apply a correction only if it is positive?", study_iteration_clamp},
        {"1e", "Target velocity", "What does stabilisation repair, and what does it cost?", study_stabilisation},
        {"1f", "A stack that does not align", "Why does the per-iteration clamp fail on a shifted stack?", study_shifted_stack},
        {"1g", "Accumulated clamp", "Does clamping the sum hold the stack, from zero and warm-started?", study_accumulated},
        {"1h", "Strengths and weaknesses", "Where is the method strong, where weak?", study_strengths},
        {"2a", "The friction force", "Is G_Tᵀλ_T the friction force with its torques?", study_friction_force},
        {"2b", "Friction along one direction", "How far does t₁ = v_T/‖v_T‖ carry?", study_one_direction},
        {"2c", "Static friction", "Why does one direction not hold static friction?", study_static_friction},
        {"2d", "The friction pyramid", "What do two directions mend, and what do they bend?", study_pyramid},
        {"2e", "Tough scenes", "How many boxes can be stacked, and how heavy may a body on a light one be?", study_limits},
        {"2f", "The maze", "How does the maze run with this method, and how in Bullet?", study_maze},
    };
    return topics;
}

}  // namespace cairn::cli
