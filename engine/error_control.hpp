// Steps to a tolerance: with WorldSettings::tolerance = E > 0 every island, and every free body whose rotation has no closed form, takes
// the coarsest step whose estimated error stays under E dt.
//
// Levels: each is a finer way to make the same step, at some twice the cost of the one before.
//     contacts   2^level substeps (sequential impulses, direct and mixed solver)
//     joints     RATTLE: one stage, then 2^(level − 1) substeps of five (solver/rattle_rate.hpp)
//     free       0: one stage of the rotor, then 2^(level − 1) substeps of five
// Estimate: the step is made at its level and, from the same start, at the next. As that is several times as exact, the difference is the
// error of the coarser (step doubling: Richardson 1911; Hairer, Nørsett, Wanner 1993, section II.4),
//     e = max over bodies ‖Δx‖ + r ‖Δθ‖ + (‖Δv‖ + r ‖Δω‖) τ,
// r the radius about the centre of mass: an error of velocity counts as what it makes of the position while it lasts, τ = 1 s in free
// flight and 0.2 s where contacts and joints turn velocities about. The finer result is kept. If e > E dt, the level rises and the step is
// made again; with e > E dt / 2 it rises for the steps to come; if e times the growth that was last measured from a level to the coarser
// one leaves room, it falls.
//
// Estimates are made in few steps: 1, 2, 4 … kLongestInterval steps apart while they hold, and at once where something happens: other
// bodies, contacts or joints in the island, a caller's hand, or a velocity whose change differs from that of the step before by more than
// twice what it did when last measured, if that moves a body by E dt.
//
// All of it is a function of the world's history alone, and part of World::hash. Nothing is saved for a second try: an island is built from
// the world's bodies, which are not written before it is done.
#pragma once

#include "engine/world_data.hpp"

#include <algorithm>

namespace cairn {

constexpr int kFinestLevel = 8;
constexpr int kUncontrolled = -1;

// At the start of a step: a place for every body.
void prepare_error_control(WorldData& world);

// Whether the island's error has to be measured in this step, whatever comes out of it.
bool is_estimate_due(WorldData& world, int index);
// Whether no estimate is due and velocities in `work` have changed as they did at the last; notes how they change.
bool goes_on_as_before(WorldData& world, IslandWorkspace& work, int index, bool due);
// Keeps the result in `work` as the coarser one; compares it with that in `work` [m].
void keep_coarse(IslandWorkspace& work);
Real error_of_coarse(const IslandWorkspace& work);
// What one worker has measured, into the step's report.
void take_error_report(const StepReport& part, StepReport& report);
// Takes an estimate that holds: the level and the interval of the steps to come.
void take_estimate(ErrorControl& control, Real error, Real admitted);

inline ErrorControl& control_of(WorldData& world, int index) {
    return world.control[world.islands.body_list()[world.islands.bodies(index).begin]];
}

// Raises the level until the error of its step is admitted, and takes that estimate: attempt(level) makes the step at the next level and
// returns the error of the step before [m].
template <typename Attempt>
void refine(ErrorControl& control, Real admitted, StepReport& report, Attempt attempt) {
    Real coarser = 0;
    for (;; ++control.level) {
        const Real error = attempt(control.level + 1);
        ++report.error_estimates;
        if (coarser > 0 && error > 0) control.gained = coarser / error;
        if (error <= admitted || control.level + 1 >= kFinestLevel) {
            report.tolerance_missed += !(error <= admitted);
            take_estimate(control, error, admitted);
            return;
        }
        coarser = error;
        ++report.steps_refined;
    }
}

// A free body whose motion has no closed form (spin of unequal moments, or under a torque): its step to the tolerance.
bool needs_error_control(const Body& body);
bool move_to_tolerance(WorldData& world, IslandWorkspace& work, std::uint32_t body, Real dt);  // false: not finite, and stays

// Steps island `index` to the tolerance: attempt(level) solves it from its start into `work`, and is false where it cannot.
template <typename Attempt>
bool solve_to_tolerance(WorldData& world, IslandWorkspace& work, int index, Real dt, Attempt attempt) {
    const Real admitted = world.settings.tolerance * dt;
    ErrorControl& control = control_of(world, index);
    const bool due = is_estimate_due(world, index);
    if (!attempt(control.level)) return false;
    if (goes_on_as_before(world, work, index, due)) {
        work.report.error_rate = std::max(work.report.error_rate, control.error / dt);
        return true;
    }
    bool solved = true;
    keep_coarse(work);
    refine(control, admitted, work.report, [&](int level) -> Real {
        solved = solved && attempt(level);
        if (!solved) return 0;
        const Real error = error_of_coarse(work);
        keep_coarse(work);
        return error;
    });
    work.report.error_rate = std::max(work.report.error_rate, control.error / dt);
    return solved;
}

}  // namespace cairn
