// How a world steps. Every value has a default that is meant to be kept.
#pragma once

#include "engine/base/math.hpp"
#include "engine/tasks.hpp"
#include "solver/si_model.hpp"

#include <cstdint>

namespace cairn {

// What solves an island (bodies tied together by contacts and joints).
//   kAuto    chosen per island and step from what it holds
//   kSi      sequential impulses, takes everything
//   kDirect  active set with a sparse factorisation: islands with contacts, without joints and restitution
//   kRattle  RATTLE with a sparse factorisation: islands with joints alone
//   kMixed   joints by a sparse factorisation, contacts by sweeps around them: islands with both
//   kTgs     soft contacts and joints, one sweep a solve (solver/tgs.hpp), takes everything; never chosen by kAuto
// A solver that is forced on an island that it cannot take leaves it where it is, and the StepReport says so.
enum class SolverChoice : std::uint8_t { kAuto, kSi, kDirect, kRattle, kMixed, kTgs };
constexpr int kSolverChoices = 6;

// [s]: shortest substep h. A penetration d is taken back with velocities of d / (10 h) that are removed again after the drift, which leaves
// a rounding error of 1e-16 of them: for d = 0.1 m, 1e-6 m/s here, and for far shorter substeps a body at rest would be blown away.
constexpr Real kLeastSubstep = 1e-12;

struct WorldSettings {
    Vec3 gravity{0, 0, -9.81};  // [m/s²]
    int substeps = 4;           // per step, >= 1; `auto` takes fewer where that serves (islands that rest, piles that move)
    int iterations = 2;         // most sweeps per solve, >= 1; more in the first solve of a substep that stands for several
    // [m/s]: a solve stops sweeping once no row changes its velocity by more. With 0 it still stops where a sweep changes nothing at all,
    // since another one would not either.
    Real residual_tolerance = 1e-4;
    // [m/s]: position error admitted per simulated second. Above 0 the substeps of each island and of each free body are chosen from
    // estimates of its error (engine/error_control.hpp), not from `substeps`, and solves end where this admits it, not by `iterations`.
    Real tolerance = 0;
    SolverChoice solver = SolverChoice::kAuto;
    Stabilisation stabilisation = Stabilisation::kSplit;
    SiModel model;  // of sequential impulses
    bool sleep = false;
    bool profile = false;      // measure the stages of each step: StepReport::profile
    bool diagnostics = false;  // measure how well each step is solved: StepReport::diagnostics
    int threads = 1;           // >= 1; more than one only if Cairn was built with oneTBB. The results are the same
    // Runs the work instead of `threads`, if there is one (engine/tasks.hpp).
    std::shared_ptr<TaskSystem> tasks;
};

}  // namespace cairn
