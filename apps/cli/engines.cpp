#include "apps/cli/engines.hpp"

#include "apps/cli/options.hpp"
#include "apps/cli/rivals/module.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace cairn::cli {

namespace fs = std::filesystem;

namespace {

class Cairn : public Rival {
public:
    Cairn(const Scene& scene, const EngineSettings& settings) : scene_(scene), built_(build_world(scene, world_settings(settings))) {}

    std::string version() const override { return CAIRN_VERSION; }
    int precision() const override { return 64; }
    std::string settings() const override {
        const WorldSettings& s = built_.world.settings();
        return fmt::format("{} substeps, {} iterations, solver {}, {}, residual tolerance {} m/s, {} threads", s.substeps, s.iterations,
                           solver_name(s.solver), stabilisation_name(s.stabilisation), s.residual_tolerance, s.threads) +
               (s.tolerance > 0 ? fmt::format(", tolerance {} m/s", s.tolerance) : std::string());
    }
    void step(Real dt) override {
        const StepReport report = built_.world.step(dt);
        contacts_ = static_cast<int>(report.contacts);
        if (report.profile != nullptr) {
            phases_.resize(kPhases);
            for (std::size_t k = 0; k < kPhases; ++k) phases_[k] += report.profile->seconds[k];
        }
        if (report.islands_refused > 0) throw Unsupported("an island that the forced solver cannot take");
        if (!report.ok) throw Error("a body went non-finite");
    }
    void states(std::vector<BodyState>& out) const override {
        out.clear();
        for (const BodyId id : built_.ids) out.push_back(built_.world.state(id));
    }
    int contacts() const override { return contacts_; }
    std::vector<double> phases() const override { return phases_; }

private:
    static WorldSettings world_settings(const EngineSettings& s) {
        RunOptions options;
        options.substeps = s.substeps;
        options.iterations = s.iterations;
        options.threads = s.threads;
        options.sleep = s.sleep;
        options.solver = s.solver;
        options.residual_tolerance = s.residual_tolerance;
        options.tolerance = s.tolerance;
        options.profile = s.profile;
        return settings_from(options);
    }

    const Scene& scene_;
    SceneWorld built_;
    int contacts_ = 0;
    std::vector<double> phases_;  // [s]
};

struct Variant {
    const char* module;
    const char* variant;
};
constexpr Variant kVariants[] = {{"bullet", "2dir"}, {"bullet64", "2dir"}, {"ode", "worldstep"}, {"ode", "fdir"}};

// Local, so that modules of two builds of one engine do not take each other's symbols; and never unloaded.
MakeRival* load_maker(const std::string& module, const std::string& wanted) {
    const fs::path path = fs::path(rival_folder()) / (module + ".so");
    std::error_code ignored;
    if (!fs::exists(path, ignored)) {
        std::string list;
        for (const std::string& name : engine_names()) list += (list.empty() ? "" : ", ") + name;
        throw_invalid("engine", wanted, "one of " + list);
    }
    void* loaded = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (loaded == nullptr) throw Error(path.string() + ": cannot be loaded: " + dlerror());
    void* symbol = dlsym(loaded, kMakeRival);
    if (symbol == nullptr) throw Error(path.string() + ": is no adapter of an engine");
    return reinterpret_cast<MakeRival*>(symbol);
}

}  // namespace

std::string rival_folder() {
    if (const char* given = std::getenv("CAIRN_RIVALS"); given != nullptr && given[0] != '\0') return given;
    std::error_code ignored;
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    for (const char* lib : {"lib", CAIRN_LIB_FOLDER}) {
        const fs::path folder = program.parent_path().parent_path() / lib / "cairn" / "rivals";
        if (fs::is_directory(folder, ignored)) return folder.string();
    }
    return {};
}

std::vector<std::string> engine_names() {
    std::vector<std::string> names;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(rival_folder(), error)) {
        if (entry.path().extension() != ".so") continue;
        const std::string module = entry.path().stem().string();
        names.push_back(module);
        for (const Variant& v : kVariants) {
            if (module == v.module) names.push_back(module + "-" + v.variant);
        }
    }
    std::sort(names.begin(), names.end());
    names.insert(names.begin(), "cairn");
    return names;
}

std::unique_ptr<Rival> make_engine(const std::string& name, const Scene& scene, const EngineSettings& settings) {
    if (name == "cairn") return std::make_unique<Cairn>(scene, settings);
    const std::size_t dash = name.find('-');
    RivalOptions options;
    options.substeps = settings.substeps;
    options.iterations = settings.iterations;
    options.sleep = settings.sleep;
    if (dash != std::string::npos) options.variant = name.substr(dash + 1);
    return std::unique_ptr<Rival>(load_maker(name.substr(0, dash), name)(scene, options));
}

}  // namespace cairn::cli
