// Runs of the studies: a scene under a model, or in another engine.
#pragma once

#include "engine/scene/scene.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cairn::cli {

class Rival;

// How a scene is run.
struct StudyModel {
    std::string name;
    WorldSettings settings;  // of Cairn
    std::string engine;      // of another engine (engines.hpp); empty: Cairn
    Real dt = 1.0 / 60;      // [s]
};

// The textbook: one substep, every one of the sweeps, target velocity, fixed tangents, impulses that start at zero in every step.
StudyModel textbook(const std::string& name, int iterations = 10);
StudyModel textbook_warm(const std::string& name, int iterations = 10);
// Sequential impulses as they come (split, 4 substeps of 2 sweeps), and the engine as it comes (solver chosen by island).
StudyModel default_si();
StudyModel default_auto();
// Debian's Bullet in double precision as it comes.
StudyModel bullet();

// One run. Throws Error (Unsupported among it) if the engine cannot be had.
class StudyRun {
public:
    StudyRun(const Scene& scene, const StudyModel& model);
    ~StudyRun();
    void step();
    Real time() const { return static_cast<Real>(steps_) * model_.dt; }
    const std::vector<BodyState>& states() const { return states_; }
    World* world() { return built_ ? &built_->world : nullptr; }  // null for other engines
    const StepReport& report() const { return report_; }          // of the last step; Cairn's
    double median_step() const;                                   // [s] of wall time
    Real mean_sweeps() const;                                     // over contact rows, per step

private:
    const Scene& scene_;
    StudyModel model_;
    std::unique_ptr<SceneWorld> built_;
    std::unique_ptr<Rival> rival_;
    std::vector<BodyState> states_;
    StepReport report_;
    std::vector<double> walls_;
    std::uint64_t sweeps_ = 0;
    long steps_ = 0;
};

// Whether this build and machine have the engine of the model; `why` says if not.
bool is_available(const StudyModel& model, std::string* why = nullptr);

// How a scene that should stand stood.
struct Standing {
    bool available = true;
    Real fell_at = -1;     // [s], when a body was more than `limit` from its start; −1: never
    Real drift = 0;        // [m], largest distance of a body from its start, at the end
    Real penetration = 0;  // [m], deepest point of the last second; −1: not known
    Real residual = 0;     // [m/s], largest of the last second: natural map (textbook), last change (default)
    Real sweeps = 0;       // per step
    double step_time = 0;  // [s], median
    bool stands() const { return available && fell_at < 0; }
};

using StudyObserver = std::function<void(StudyRun&)>;
Standing stand(const Scene& scene, const StudyModel& model, Real duration, Real limit, const StudyObserver& each = {});

// Cells of a table: model, result, drift, penetration, residual, sweeps, time.
extern const std::vector<std::string> kStandingColumns;
std::vector<std::string> standing_row(const StudyModel& model, const Standing& s);

// The largest n of [0, most] for which `stands(n)`, by doubling and bisection (taken as monotone).
int largest_standing(int most, const std::function<bool(int)>& stands);

}  // namespace cairn::cli
