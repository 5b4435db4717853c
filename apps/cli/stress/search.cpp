#include "apps/cli/stress/search.hpp"

#include "apps/cli/options.hpp"
#include "apps/cli/truths/soundness.hpp"
#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace cairn::cli {

namespace {

double step_of(const Limit& limit, double rung) {
    return limit.dt != nullptr ? limit.dt(rung) : 1.0 / 60;
}

std::string judge(const Limit& limit, const SceneFile& file, const EngineRun& run) {
    if (run.status == RunStatus::kUnsupported) throw Unsupported(run.note);
    if (run.status != RunStatus::kOk) return fmt::format("{}: {}", to_string(run.status), run.note);
    if (!is_whole(file.scene, run.history)) return "not finite";
    if (const std::string reason = limit.verdict(file.scene, run); !reason.empty()) return reason;
    return unsound(file.scene, run.history);
}

// Keeps the scene and says how to run it.
std::string command_of(const Limit& limit, double rung, const EngineChoice& engine, const StressSettings& s, const std::string& text) {
    std::string path = fmt::format("{}_{:.4g}.json", limit.name, rung);
    if (!s.scene_folder.empty()) {
        path = (std::filesystem::path(s.scene_folder) / path).string();
        std::ofstream(path, std::ios::binary) << text;
    }
    std::string command = fmt::format("cairn bench --scene {} --engines {} --dt {:.6g}", path, engine.name, step_of(limit, rung));
    if (s.engine.solver && engine.name == "cairn") command += fmt::format(" --solver {}", solver_name(*s.engine.solver));
    return command;
}

}  // namespace

int highest_passing(int rungs, const std::function<std::string(int)>& passes, std::string& reason) {
    int held = -1, failed = rungs;  // the ends are taken as known
    while (failed - held > 1) {
        // The first question is an easy one: most engines fail somewhere in the middle, and hard rungs cost most.
        const int middle = held + (failed - held) / 2;
        const std::string why = passes(middle);
        if (why.empty()) {
            held = middle;
        } else {
            failed = middle;
            reason = why;
        }
    }
    return held;
}

LimitResult search_limit(const Limit& limit, const EngineChoice& engine, const StressSettings& settings) {
    LimitResult r;
    r.limit = limit.name;
    r.engine = engine.name;
    r.solver = settings.engine.solver && engine.name == "cairn" ? solver_name(*settings.engine.solver) : "";
    r.rungs = static_cast<int>(limit.rungs.size());
    const auto passes = [&](int k) {
        const double rung = limit.rungs[static_cast<std::size_t>(k)];
        SceneFile file;
        file.text = limit.scene(rung, settings.quick);
        file.scene = parse_scene(file.text, limit.name);
        EngineSettings s = settings.engine;
        s.dt = step_of(limit, rung);
        return judge(limit, file, run_engine(engine, file, s, settings.timeout));
    };
    try {
        r.held = highest_passing(r.rungs, passes, r.failed_at);
    } catch (const Unsupported& error) {
        r.note = std::string("unsupported: ") + error.what();
        return r;
    }
    const auto command = [&](double rung) { return command_of(limit, rung, engine, settings, limit.scene(rung, settings.quick)); };
    if (r.held >= 0) {
        r.value = limit.rungs[static_cast<std::size_t>(r.held)];
        r.held_command = command(r.value);
    }
    if (r.held + 1 < r.rungs) {
        r.failed_value = limit.rungs[static_cast<std::size_t>(r.held + 1)];
        r.failed_command = command(r.failed_value);
    }
    return r;
}

}  // namespace cairn::cli
