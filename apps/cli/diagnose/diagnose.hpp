// Why a stack fails, a joint stretches or a body creeps: symptoms of a run, their causes, and what cures them.
//
// A run gives evidence (evidence.hpp). What moves, stretches or sinks beyond its limit (limits.hpp) is a symptom. Each
// cause is a small function from the evidence to a finding, or none. Causes of mechanics (the slope is steep, the support ends) come
// first: what they explain is no fault of the solver. A finding brings cures, settings or changes of the scene, that are tried by running
// them; the same symptom is measured again.
#pragma once

#include "apps/cli/diagnose/evidence.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cairn::cli {

enum class SymptomKind : std::uint8_t { kBreaks, kMoves, kStretches, kTwists, kSinks };

struct Symptom {
    SymptomKind kind = SymptomKind::kMoves;
    std::size_t index = 0;  // of the body (breaks, moves), joint (stretches, twists), or upper or lighter body of the pair (sinks)
    std::size_t other = 0;  // sinks: the other body of the pair
    int group = -1;
    Real value = 0;  // [m], or [rad] of kTwists
    Real limit = 0;  // from which on it is one
};

// The worst of each kind in each group of bodies that touch or are joined; those farthest beyond their limits first.
std::vector<Symptom> find_symptoms(const Scene& scene, const Evidence& evidence);
// What another run shows of it.
Real measure_again(const Symptom& symptom, const Evidence& evidence);

// Something to try.
struct Cure {
    std::string says;  // "--substeps 16", or what to change in the scene
    std::function<void(Scene&, RunOptions&)> apply;
};

struct Trial {
    std::string says;
    Real after = 0;
    bool cured = false;
};

struct Finding {
    std::string cause;  // key: mass-ratio, iteration-cap, long-step, overlap, reach, friction, support, unknown
    std::string says;   // a sentence
    std::vector<std::string> bodies;
    std::optional<Symptom> symptom;  // that it explains
    std::vector<Cure> cures;         // the likeliest first
    std::string no_cure;             // why nothing is tried, if so
    std::vector<Trial> trials;
};

struct Case {
    const Scene& scene;
    const RunOptions& options;
    const Evidence& evidence;
};

// The causes, one by one. Nothing: it is not this.
std::vector<Finding> find_overlaps(const Case& c);                                // whatever the symptoms
std::optional<Finding> find_reach(const Case& c, const Symptom& symptom);         // stretches
std::optional<Finding> find_steep_slope(const Case& c, const Symptom& symptom);   // moves
std::optional<Finding> find_weak_support(const Case& c, const Symptom& symptom);  // moves
std::optional<Finding> find_mass_ratio(const Case& c, const Symptom& symptom);
std::optional<Finding> find_long_step(const Case& c, const Symptom& symptom);
std::optional<Finding> find_iteration_cap(const Case& c, const Symptom& symptom);
Finding unknown_cause(const Case& c, const Symptom& symptom);

// All findings of a run; nothing tried yet.
std::vector<Finding> find_causes(const Case& c);

// Runs cures until one brings the symptom under its limit.
void try_cures(const Case& c, Finding& finding, const std::function<void(const std::string&)>& on_try = {});

// "box_4 should rest, but moves 0.53 m".
std::string symptom_text(const Symptom& symptom, const Scene& scene);
std::string number_text(const Symptom& symptom, Real value);

// Cures that are settings of the solver.
Cure more_iterations(const RunOptions& options);
Cure more_substeps(const RunOptions& options);
Cure shorter_step(const RunOptions& options, int parts);
std::optional<Cure> other_solver(const Scene& scene, const RunOptions& options, SolverChoice solver);

}  // namespace cairn::cli
