// What is known of scenes without any engine, and how far a run was from it. Every number is taken from the scene itself.
#pragma once

#include "engine/scene/scene.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace cairn::cli {

// The sampled states of a run: states[k][i] is body i of the scene at time t[k].
struct History {
    std::vector<Real> t;  // [s], ascending, t[0] = 0
    std::vector<std::vector<BodyState>> states;
};

enum class TruthKind : std::uint8_t {
    kClosedForm,
    kReference,  // integrated to about twelve digits beside the run
    kInvariant,  // what every exact motion keeps: no penetration, joints that hold
};
const char* to_string(TruthKind kind);

struct TruthError {
    Real value = 0;
    const char* unit = "";  // "m", "1" (relative) …
    const char* what = "";
    std::string failed;  // why the run does not count, whatever the value; empty: it does
};

using TruthFunction = TruthError (*)(const Scene& scene, const History& history);

struct Truth {
    TruthFunction error = nullptr;
    TruthKind kind = TruthKind::kInvariant;
    // Where `error` is an invariant, which may be kept on a wrong way: how far the run is from the true way. Its order of convergence is
    // measured. Null: there is no such reference, or `error` is that already.
    TruthFunction path = nullptr;
};

// The truth of a scene: by its name where the table of truths.cpp has it, else by what it holds: joints that hold, or else no penetration.
Truth truth_of(const Scene& scene);

// Each needs at least one dynamic body and two samples; those that speak of ground need a static plane.
TruthError parabola(const Scene& scene, const History& history);
TruthError stopping_distance(const Scene& scene, const History& history);
TruthError sliding_down(const Scene& scene, const History& history);
TruthError rolling_speed(const Scene& scene, const History& history);
TruthError rolling_down(const Scene& scene, const History& history);
TruthError steady_rolling(const Scene& scene, const History& history);
TruthError bounce_heights(const Scene& scene, const History& history);
TruthError creep(const Scene& scene, const History& history);
TruthError pendulum_path(const Scene& scene, const History& history);
TruthError sliding_along_axis(const Scene& scene, const History& history);
TruthError at_rest(const Scene& scene, const History& history);
// Against the reference of truths/mechanism.hpp.
TruthError reference_position(const Scene& scene, const History& history);
TruthError reference_start(const Scene& scene, const History& history);
TruthError reference_rotation(const Scene& scene, const History& history);
TruthError tipping_box(const Scene& scene, const History& history);
// Impacts of balls, worked out one after the other.
TruthError impact_velocity(const Scene& scene, const History& history);
TruthError impact_velocity_and_spin(const Scene& scene, const History& history);
// What must or must not happen.
TruthError must_fall(const Scene& scene, const History& history);
TruthError passed_wall(const Scene& scene, const History& history);
TruthError unexplained_speed(const Scene& scene, const History& history);
TruthError chain_stretch(const Scene& scene, const History& history);
TruthError joint_separation(const Scene& scene, const History& history);
TruthError deepest_penetration(const Scene& scene, const History& history);
TruthError usual_penetration(const Scene& scene, const History& history);

}  // namespace cairn::cli
