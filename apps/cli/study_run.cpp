#include "apps/cli/study_run.hpp"

#include "apps/cli/engines.hpp"
#include "apps/cli/report.hpp"
#include "apps/cli/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

namespace cairn::cli {

namespace {

// A scene to see whether an engine is there.
Scene empty_scene() {
    Scene scene;
    scene.name = "probe";
    BodyDef ball;
    ball.name = "ball";
    ball.shapes = {Shape::sphere(0.5)};
    scene.bodies.push_back(ball);
    return scene;
}

Real largest_drift(const Scene& scene, const std::vector<BodyState>& states) {
    Real drift = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (scene.bodies[i].type == BodyType::kDynamic) drift = std::max(drift, (states[i].position - scene.bodies[i].position).norm());
    }
    return drift;
}

}  // namespace

StudyModel textbook(const std::string& name, int iterations) {
    StudyModel m;
    m.name = name;
    m.settings.solver = SolverChoice::kSi;
    m.settings.substeps = 1;
    m.settings.iterations = iterations;
    m.settings.residual_tolerance = 0;
    m.settings.stabilisation = Stabilisation::kTargetVelocity;
    m.settings.model.friction = FrictionModel::kPyramidFixed;
    m.settings.model.warm_start = false;
    return m;
}

StudyModel textbook_warm(const std::string& name, int iterations) {
    StudyModel m = textbook(name, iterations);
    m.settings.model.warm_start = true;
    return m;
}

StudyModel default_si() {
    StudyModel m;
    m.name = "Cairn's default substep (`si`)";
    m.settings.solver = SolverChoice::kSi;
    return m;
}

StudyModel default_auto() {
    StudyModel m;
    m.name = "Cairn as it comes (`auto`)";
    return m;
}

StudyModel bullet() {
    StudyModel m;
    m.name = "Bullet";
    m.engine = "bullet64";
    return m;
}

StudyRun::StudyRun(const Scene& scene, const StudyModel& model) : scene_(scene), model_(model) {
    if (model.engine.empty()) {
        built_ = std::make_unique<SceneWorld>(build_world(scene, model.settings));
        states_.resize(scene.bodies.size());
        for (std::size_t i = 0; i < states_.size(); ++i) states_[i] = built_->world.state(built_->ids[i]);
        return;
    }
    EngineSettings settings;
    settings.dt = model.dt;
    rival_ = make_engine(model.engine, scene, settings);
    rival_->states(states_);
}

StudyRun::~StudyRun() = default;

void StudyRun::step() {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    if (built_) {
        report_ = built_->world.step(model_.dt);
    } else {
        rival_->step(model_.dt);
    }
    walls_.push_back(std::chrono::duration<double>(Clock::now() - start).count());
    ++steps_;
    sweeps_ += report_.contact_sweeps;
    if (built_) {
        for (std::size_t i = 0; i < states_.size(); ++i) states_[i] = built_->world.state(built_->ids[i]);
    } else {
        rival_->states(states_);
    }
}

double StudyRun::median_step() const {
    std::vector<double> sorted = walls_;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? 0 : sorted[sorted.size() / 2];
}

Real StudyRun::mean_sweeps() const {
    return steps_ > 0 ? static_cast<Real>(sweeps_) / static_cast<Real>(steps_) : 0;
}

bool is_available(const StudyModel& model, std::string* why) {
    if (model.engine.empty()) return true;
    const std::vector<std::string> names = engine_names();
    if (std::find(names.begin(), names.end(), model.engine) == names.end()) {
        if (why != nullptr) *why = model.engine + " is not in this build (CAIRN_WITH_BULLET, Debian: libbullet-dev, libbullet-extras-dev)";
        return false;
    }
    try {
        const Scene probe = empty_scene();
        EngineSettings settings;
        make_engine(model.engine, probe, settings);
    } catch (const std::exception& error) {
        if (why != nullptr) *why = error.what();
        return false;
    }
    return true;
}

Standing stand(const Scene& scene, const StudyModel& model, Real duration, Real limit, const StudyObserver& each) {
    Standing result;
    if (!is_available(model)) {
        result.available = false;
        return result;
    }
    StudyRun run(scene, model);
    const long steps = std::lround(duration / model.dt);
    if (!model.engine.empty()) result.penetration = -1;
    for (long k = 1; k <= steps; ++k) {
        run.step();
        if (each) each(run);
        result.drift = largest_drift(scene, run.states());
        // Not: drift > limit, which what is not a number would pass.
        if (!(result.drift <= limit)) {
            result.fell_at = run.time();
            break;
        }
        if (run.world() == nullptr || run.time() < duration - 1) continue;
        result.penetration = std::max(result.penetration, run.report().max_penetration);
        result.residual = std::max({result.residual, run.report().residual, run.report().natural_residual});
    }
    result.sweeps = run.mean_sweeps();
    result.step_time = run.median_step();
    return result;
}

const std::vector<std::string> kStandingColumns = {"model",          "result",        "drift [m]",  "deepest point [m]",
                                                   "residual [m/s]", "sweeps a step", "time a step"};

std::vector<std::string> standing_row(const StudyModel& model, const Standing& s) {
    if (!s.available) return {model.name, "not in this build", "–", "–", "–", "–", "–"};
    const bool cairn = model.engine.empty();
    const std::string result = s.fell_at >= 0 ? fmt::format("falls at {:.1f} s", s.fell_at) : s.drift > 0.01 ? "creeps" : "stands";
    return {model.name,
            result,
            s.fell_at >= 0 ? "–" : number(s.drift),
            s.penetration < 0 || s.fell_at >= 0 ? "–" : number(s.penetration),
            cairn && s.fell_at < 0 ? number(s.residual) : "–",
            cairn ? fmt::format("{:.3g}", s.sweeps) : "–",
            readable_time(s.step_time)};
}

int largest_standing(int most, const std::function<bool(int)>& stands) {
    int good = 0, bad = most + 1;
    for (int n = 1; n <= most; n = std::min(2 * n, most)) {
        if (!stands(n)) {
            bad = n;
            break;
        }
        good = n;
        if (n == most) break;
    }
    while (bad - good > 1) {
        const int n = (good + bad) / 2;
        (stands(n) ? good : bad) = n;
    }
    return good;
}

}  // namespace cairn::cli
