// Where the time of a step goes and what the narrow phase was asked. Measured only with WorldSettings::profile; then it takes one reading
// of the clock a stage and two an island. The times never influence a result.
#pragma once

#include "collision/shape.hpp"

#include <chrono>
#include <cstdint>

namespace cairn {

// Stages of the step, in their order (rows, solve and store take turns, island by island).
enum class Phase : std::uint8_t {
    kBroadPhase,   // boxes of what moved, pairs begun and ended
    kNarrowPhase,  // manifolds reused or made anew
    kIslands,      // what touches a sleeping body wakes it; who is tied to whom
    kRows,         // bodies, contacts and joints of an island brought into the solver's form
    kSolve,        // the sweeps or the factorisation, and the motion of the island's bodies
    kStore,        // states and impulses taken back
    kIntegrate,    // bodies that nothing holds, and kinematic ones
    kSleep,
};
constexpr int kPhases = 8;
constexpr int kShapeTypes = 7;

// Of one step.
struct StepProfile {
    double seconds[kPhases] = {};  // by Phase
    // Narrow-phase queries (manifolds that could not be reused) and the calls into FCL that they took, by the types of the two shapes, the
    // lower one first.
    std::uint32_t queries_of[kShapeTypes][kShapeTypes] = {};
    std::uint32_t fcl_calls_of[kShapeTypes][kShapeTypes] = {};
    std::uint32_t pairs_begun = 0;
    std::uint32_t pairs_ended = 0;
    std::uint32_t proxies_moved = 0;         // shapes that left their fat box
    std::uint32_t separating_axis_hits = 0;  // queries that the cached axis answered
};

// Writes the time since the last reading to a stage; does nothing while it is off. No allocation.
class PhaseClock {
public:
    // Clears the profile and takes the first reading.
    void start(bool on) {
        on_ = on;
        if (!on_) return;
        profile_ = {};
        last_ = Clock::now();
    }
    void lap(Phase phase) {
        if (!on_) return;
        const Clock::time_point now = Clock::now();
        profile_.seconds[static_cast<int>(phase)] += std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }
    bool on() const { return on_; }
    StepProfile& profile() { return profile_; }
    const StepProfile& profile() const { return profile_; }

private:
    using Clock = std::chrono::steady_clock;
    bool on_ = false;
    Clock::time_point last_;
    StepProfile profile_;
};

}  // namespace cairn
