// What is known of the shipped scenes in closed form, and how far a run was from it. Every number is taken from the scene itself.
#pragma once

#include "engine/scene/scene.hpp"

#include <string>
#include <vector>

namespace cairn::cli {

// The sampled states of a run: states[k][i] is body i of the scene at time t[k].
struct History {
    std::vector<Real> t;  // [s], ascending, t[0] = 0
    std::vector<std::vector<BodyState>> states;
};

struct TruthError {
    Real value = 0;
    const char* unit = "";  // "m", "1" (relative) …
    const char* what = "";
};

using TruthFunction = TruthError (*)(const Scene& scene, const History& history);

// The truth that belongs to a scene of this name, or nullptr if there is none in closed form.
TruthFunction truth_of(const std::string& scene_name);

// Each needs at least one dynamic body and two samples; those that speak of ground need a static plane.
TruthError parabola(const Scene& scene, const History& history);
TruthError momentum_kept(const Scene& scene, const History& history);
TruthError stopping_distance(const Scene& scene, const History& history);
TruthError sliding_down(const Scene& scene, const History& history);
TruthError rolling_speed(const Scene& scene, const History& history);
TruthError rolling_down(const Scene& scene, const History& history);
TruthError steady_rolling(const Scene& scene, const History& history);
TruthError bounce_heights(const Scene& scene, const History& history);
TruthError cradle_exchange(const Scene& scene, const History& history);
TruthError pendulum_path(const Scene& scene, const History& history);
TruthError rod_length(const Scene& scene, const History& history);
TruthError sliding_along_axis(const Scene& scene, const History& history);
TruthError axial_momentum(const Scene& scene, const History& history);
TruthError at_rest(const Scene& scene, const History& history);

}  // namespace cairn::cli
