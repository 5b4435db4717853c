// Causes that lie in how the scene is solved: mass ratios, sweeps that are cut off, steps that are too long.
#include "apps/cli/diagnose/diagnose.hpp"
#include "apps/cli/diagnose/limits.hpp"
#include "apps/cli/options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace cairn::cli {

namespace {

const GroupEvidence& group_of(const Case& c, const Symptom& s) {
    static const GroupEvidence kNone;
    return s.group < 0 ? kNone : c.evidence.groups[static_cast<std::size_t>(s.group)];
}

bool sweeps_solve(const GroupEvidence& g) {
    const auto steps = [&](SolverChoice solver) { return g.solver_steps[static_cast<int>(solver)]; };
    return steps(SolverChoice::kSi) + steps(SolverChoice::kTgs) + steps(SolverChoice::kMixed) > 0;
}

bool is_cut_off(const GroupEvidence& g) {
    return g.si_islands > 0 && static_cast<Real>(g.capped_islands) >= limits::kCapped * static_cast<Real>(g.si_islands) &&
           g.residual > limits::kResidual;
}

std::string residual_text(const GroupEvidence& g) {
    return g.worst_b.empty() && g.worst_a.empty()
               ? fmt::format("{:.2g} m/s", g.residual)
               : fmt::format("{:.2g} m/s between {} and {}", g.residual, g.worst_a.empty() ? "the world" : g.worst_a,
                             g.worst_b.empty() ? "the world" : g.worst_b);
}

void add(std::vector<Cure>& cures, std::optional<Cure> cure) {
    if (cure) cures.push_back(std::move(*cure));
}

// Bodies of the group that touch or are joined: heavy over light, or joined to it.
struct Ratio {
    std::size_t heavy = 0, light = 0;
    Real value = 0;
};

Ratio largest_ratio(const Case& c, int group) {
    Ratio worst;
    const auto note = [&](std::size_t heavy, std::size_t light) {
        if (c.evidence.bodies[heavy].group != group || c.evidence.bodies[light].group != group) return;
        const Real value = c.scene.bodies[heavy].mass / c.scene.bodies[light].mass;
        if (value > worst.value) worst = {heavy, light, value};
    };
    for (std::size_t i = 0; i < c.evidence.bodies.size(); ++i)
        for (const std::size_t above : c.evidence.bodies[i].on_it) note(above, i);
    for (const SceneJoint& j : c.scene.joints) {
        if (!j.body_a || !j.body_b) continue;
        note(*j.body_a, *j.body_b);
        note(*j.body_b, *j.body_a);
    }
    return worst;
}

int substeps_of(const RunOptions& o) {
    return o.substeps.value_or(WorldSettings().substeps);
}

int iterations_of(const RunOptions& o) {
    return o.iterations.value_or(WorldSettings().iterations);
}

}  // namespace

Cure more_iterations(const RunOptions& options) {
    const int n = 10 * iterations_of(options);
    return {fmt::format("--iterations {}", n), [n](Scene&, RunOptions& o) { o.iterations = n; }};
}

Cure more_substeps(const RunOptions& options) {
    const int n = 4 * substeps_of(options);
    return {fmt::format("--substeps {}", n), [n](Scene&, RunOptions& o) { o.substeps = n; }};
}

Cure shorter_step(const RunOptions& options, int parts) {
    const Real dt = options.dt / parts;
    const Real per_second = std::round(1 / dt);
    const bool is_fraction = std::abs(per_second * dt - 1) < 1e-9;
    return {is_fraction ? fmt::format("--dt 1/{}", per_second) : fmt::format("--dt {:.6g}", dt),
            [dt](Scene&, RunOptions& o) { o.dt = dt; }};
}

std::optional<Cure> other_solver(const Scene& scene, const RunOptions& options, SolverChoice solver) {
    const SolverChoice now = options.solver.value_or(SolverChoice::kAuto);
    const bool bounces = std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyDef& b) { return b.restitution > 0; });
    const bool fits = solver == SolverChoice::kAuto || (solver == SolverChoice::kDirect && scene.joints.empty() && !bounces);
    if (now == solver || !fits) return std::nullopt;
    std::string says = fmt::format("--solver {}", solver_name(solver));
    // With a model or a stabilisation of its own, auto stays with sequential impulses.
    const bool modelled = options.model || options.stabilisation.value_or(Stabilisation::kSplit) != Stabilisation::kSplit;
    if (modelled) says += " without models of si";
    return Cure{says, [solver](Scene&, RunOptions& o) {
                    o.solver = solver;
                    o.model.reset();
                    o.stabilisation.reset();
                }};
}

std::optional<Finding> find_mass_ratio(const Case& c, const Symptom& symptom) {
    const Ratio ratio = largest_ratio(c, symptom.group);
    const GroupEvidence& g = group_of(c, symptom);
    if (ratio.value < limits::kMassRatio || !sweeps_solve(g)) return std::nullopt;
    Finding f;
    f.cause = "mass-ratio";
    const BodyDef &heavy = c.scene.bodies[ratio.heavy], &light = c.scene.bodies[ratio.light];
    f.says = fmt::format("{} ({:.4g} kg) loads {} ({:.4g} kg), {:.4g} times as heavy: sweeps pass such loads on slowly, and leave {}",
                         heavy.name, heavy.mass, light.name, light.mass, ratio.value, residual_text(g));
    f.bodies = {heavy.name, light.name};
    f.symptom = symptom;
    add(f.cures, other_solver(c.scene, c.options, SolverChoice::kAuto));
    add(f.cures, other_solver(c.scene, c.options, SolverChoice::kDirect));
    f.cures.push_back(more_substeps(c.options));
    f.cures.push_back(more_iterations(c.options));
    return f;
}

std::optional<Finding> find_long_step(const Case& c, const Symptom& symptom) {
    const Real dt = c.options.dt, fall = c.scene.gravity.norm() * dt * dt;
    std::string why;
    std::string name;
    for (std::size_t i = 0; i < c.evidence.bodies.size() && why.empty(); ++i) {
        const BodyEvidence& b = c.evidence.bodies[i];
        if (b.group != symptom.group || !std::isfinite(b.least)) continue;
        name = c.scene.bodies[i].name;
        // What has fallen moves fast for that; of what should rest only the pull counts.
        const bool moves = !b.should_rest;
        if (fall > limits::kFallPerStep * b.least) {
            why = fmt::format("gravity makes {} fall {:.3g} m in a step of {:.4g} s, {:.0f} % of its thickness", name, fall, dt,
                              100 * fall / b.least);
        } else if (moves && b.way_per_step > limits::kWayPerStep * b.least) {
            why = fmt::format("{} goes {:.3g} m in a step of {:.4g} s, {:.1f} times its thickness", name, b.way_per_step, dt,
                              b.way_per_step / b.least);
        } else if (moves && b.turn_per_step > limits::kTurnPerStep) {
            why = fmt::format("{} turns by {:.2g} rad in a step of {:.4g} s", name, b.turn_per_step, dt);
        }
    }
    if (why.empty()) return std::nullopt;
    Finding f;
    f.cause = "long-step";
    f.says = "the step is too long: " + why;
    f.bodies = {name};
    f.symptom = symptom;
    for (const int parts : {4, 16}) f.cures.push_back(shorter_step(c.options, parts));
    f.cures.push_back(more_substeps(c.options));
    add(f.cures, other_solver(c.scene, c.options, SolverChoice::kAuto));
    return f;
}

std::optional<Finding> find_iteration_cap(const Case& c, const Symptom& symptom) {
    const GroupEvidence& g = group_of(c, symptom);
    if (!is_cut_off(g)) return std::nullopt;
    Finding f;
    f.cause = "iteration-cap";
    f.says = fmt::format("{:.0f} % of the solves by sequential impulses are cut off at their {} sweeps, and leave {}",
                         100 * static_cast<Real>(g.capped_islands) / static_cast<Real>(g.si_islands), iterations_of(c.options),
                         residual_text(g));
    for (const std::string& name : {g.worst_a, g.worst_b})
        if (!name.empty()) f.bodies.push_back(name);
    f.symptom = symptom;
    f.cures.push_back(more_iterations(c.options));
    add(f.cures, other_solver(c.scene, c.options, SolverChoice::kAuto));
    add(f.cures, other_solver(c.scene, c.options, SolverChoice::kDirect));
    f.cures.push_back(more_substeps(c.options));
    return f;
}

Finding unknown_cause(const Case& c, const Symptom& symptom) {
    const GroupEvidence& g = group_of(c, symptom);
    Finding f;
    f.cause = "unknown";
    f.says = fmt::format("none of the causes that are looked for; the worst row is left with {}", residual_text(g));
    f.symptom = symptom;
    add(f.cures, other_solver(c.scene, c.options, SolverChoice::kAuto));
    add(f.cures, other_solver(c.scene, c.options, SolverChoice::kDirect));
    f.cures.push_back(more_substeps(c.options));
    if (sweeps_solve(g)) f.cures.push_back(more_iterations(c.options));
    f.cures.push_back(shorter_step(c.options, 4));
    return f;
}

namespace {

void find_causes_of(const Case& c, const Symptom& s, std::vector<Finding>& findings) {
    // What mechanics explain is no fault of the solver.
    for (const auto find : {find_reach, find_steep_slope, find_weak_support}) {
        if (std::optional<Finding> f = find(c, s)) {
            findings.push_back(std::move(*f));
            return;
        }
    }
    const std::size_t before = findings.size();
    for (const auto find : {find_mass_ratio, find_long_step})
        if (std::optional<Finding> f = find(c, s)) findings.push_back(std::move(*f));
    if (findings.size() > before) return;
    std::optional<Finding> capped = find_iteration_cap(c, s);
    findings.push_back(capped ? std::move(*capped) : unknown_cause(c, s));
}

}  // namespace

std::vector<Finding> find_causes(const Case& c) {
    std::vector<Finding> findings = find_overlaps(c);
    std::set<std::pair<int, std::string>> known;
    std::set<int> overlapping;
    for (const Finding& f : findings) overlapping.insert(f.symptom->group);
    for (const Symptom& s : find_symptoms(c.scene, c.evidence)) {
        if (overlapping.count(s.group) > 0) continue;
        std::vector<Finding> of_symptom;
        find_causes_of(c, s, of_symptom);
        // The worst symptom of a group comes first: one cause of several is told of that one.
        for (Finding& f : of_symptom)
            if (known.insert({s.group, f.cause}).second) findings.push_back(std::move(f));
    }
    return findings;
}

}  // namespace cairn::cli
