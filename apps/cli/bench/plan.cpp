#include "apps/cli/bench/plan.hpp"

#include "apps/cli/generate.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/shipped_scenes.hpp"
#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>

namespace cairn::cli {

namespace fs = std::filesystem;

namespace {

// Too large for files, or more of a kind; from the generator, with its first seed.
struct Generated {
    const char* kind;
    int count;
};
constexpr Generated kGenerated[] = {{"stack", 5},  {"stack", 20}, {"stack", 40},  {"pyramid", 20},  {"pyramid", 40},
                                    {"chain", 50}, {"wall", 10},  {"balls", 300}, {"ragdolls", 10}, {"ragdolls", 50},
                                    {"hulls", 50}, {"pile", 500}, {"pile", 2000}};
constexpr std::size_t kQuickBodies = 30;

// What --work-precision is made of: scenes whose truths are known to ten digits and more, of every kind of motion, those at rest among
// them; halved steps.
constexpr const char* kWorkPrecision[] = {"torque_free", "top",        "top_spin", "pendulum", "rod_pendulum", "double_pendulum",
                                          "chain_10",    "slide_stop", "tip",      "bounce",   "stack_20"};
constexpr const char* kWorkPrecisionSteps = "1/30,1/60,1/120,1/240,1/480,1/960,1/1920";

std::vector<std::string> split(const std::string& list) {
    std::vector<std::string> parts;
    for (std::size_t start = 0; start < list.size();) {
        const std::size_t comma = std::min(list.find(',', start), list.size());
        parts.push_back(list.substr(start, comma - start));
        start = comma + 1;
    }
    return parts;
}

std::vector<std::optional<int>> whole_numbers(const char* option, const std::string& list) {
    std::vector<std::optional<int>> numbers;
    for (const std::string& part : split(list)) {
        if (part == "default") {
            numbers.emplace_back();
            continue;
        }
        int value = 0;
        const std::from_chars_result read = std::from_chars(part.data(), part.data() + part.size(), value);
        if (read.ec != std::errc() || read.ptr != part.data() + part.size() || value < 1) {
            throw_invalid(option, part, "a list of whole numbers >= 1, or default");
        }
        numbers.emplace_back(value);
    }
    return numbers;
}

std::shared_ptr<const SceneFile> scene_from_file(const std::string& path) {
    auto file = std::make_shared<SceneFile>();
    file->scene = load_scene(path);
    file->path = path;
    return file;
}
std::shared_ptr<const SceneFile> scene_from_generator(const Generated& g) {
    GeneratedScene made = generate_scene(generator(g.kind), g.count, 1);
    auto file = std::make_shared<SceneFile>();
    file->scene = parse_scene(made.text, made.name);
    file->text = std::move(made.text);
    return file;
}

std::string generated_name(const Generated& g) {
    return fmt::format("{}_{}", g.kind, g.count);
}

std::shared_ptr<const SceneFile> scene_by_name(const std::string& name) {
    for (const Generated& g : kGenerated) {
        if (name == generated_name(g)) return scene_from_generator(g);
    }
    return scene_from_file(find_scene(name));
}

std::vector<std::shared_ptr<const SceneFile>> chosen_scenes(const BenchRequest& r) {
    std::vector<std::shared_ptr<const SceneFile>> scenes;
    const auto wanted = [&r](const std::string& name) {
        const bool in_set =
            !r.work_precision || std::find(std::begin(kWorkPrecision), std::end(kWorkPrecision), name) != std::end(kWorkPrecision);
        return in_set && name.find(r.filter) != std::string::npos;
    };
    for (const std::string& name : r.scenes) scenes.push_back(scene_by_name(name));
    if (!r.folder.empty()) {
        std::vector<std::string> paths;
        std::error_code error;
        for (const fs::directory_entry& entry : fs::directory_iterator(r.folder, error)) {
            if (entry.path().extension() == ".json" && wanted(entry.path().stem().string())) paths.push_back(entry.path().string());
        }
        std::sort(paths.begin(), paths.end());
        for (const std::string& path : paths) scenes.push_back(scene_from_file(path));
        if (scenes.empty()) throw_invalid("--scenes", r.folder, "a folder of scene files (and --filter part of a name in it)");
    }
    if (!scenes.empty()) return scenes;
    for (const std::string& name : shipped_scene_names()) {
        if (!wanted(name)) continue;
        std::shared_ptr<const SceneFile> file = scene_from_file(find_scene(name));
        if (!r.quick || file->scene.bodies.size() <= kQuickBodies) scenes.push_back(std::move(file));
    }
    for (const Generated& g : kGenerated) {
        if (!wanted(generated_name(g))) continue;
        std::shared_ptr<const SceneFile> file = scene_from_generator(g);
        if (!r.quick || file->scene.bodies.size() <= kQuickBodies) scenes.push_back(std::move(file));
    }
    if (scenes.empty()) throw_invalid("--filter", r.filter, "part of the name of a scene (see: cairn list)");
    return scenes;
}

// One choice of what a step costs.
struct Effort {
    std::string dt;
    std::optional<int> substeps, iterations;
    std::optional<Real> residual_tolerance, tolerance;
};

std::vector<std::optional<Real>> tolerances_of(const char* option, const std::string& list) {
    std::vector<std::optional<Real>> tolerances;
    for (const std::string& part : split(list)) {
        Real value = 0;
        const std::from_chars_result read = std::from_chars(part.data(), part.data() + part.size(), value);
        if (read.ec != std::errc() || read.ptr != part.data() + part.size() || !(value >= 0)) throw_invalid(option, part, "numbers >= 0");
        tolerances.emplace_back(value);
    }
    if (tolerances.empty()) tolerances.emplace_back();
    return tolerances;
}

// Lists that are given are crossed with one another; those that are not come from the size of the benchmark, substeps and iterations one at
// a time, since they buy the same thing.
std::vector<Effort> efforts(const BenchRequest& r) {
    std::vector<std::string> steps = split(r.dt.empty() && r.work_precision ? kWorkPrecisionSteps : r.dt);
    if (steps.empty())
        steps = r.full    ? std::vector<std::string>{"1/30", "1/60", "1/120", "1/240", "1/480"}
                : r.quick ? std::vector<std::string>{"1/60", "1/240"}
                          : std::vector<std::string>{"1/60", "1/240"};
    for (const std::string& dt : steps) parse_time_step(dt);
    std::vector<std::pair<std::optional<int>, std::optional<int>>> work;
    if (r.substeps.empty() && r.iterations.empty() && r.full) {
        work = {{{}, {}}, {1, {}}, {8, {}}, {{}, 4}, {{}, 20}, {{}, 100}};
    } else {
        const std::string defaults = "default";
        for (const std::optional<int>& s : whole_numbers("--substeps", r.substeps.empty() ? defaults : r.substeps)) {
            for (const std::optional<int>& i : whole_numbers("--iterations", r.iterations.empty() ? defaults : r.iterations))
                work.emplace_back(s, i);
        }
    }
    const std::vector<std::optional<Real>> residuals = tolerances_of("--residual-tolerance", r.residual_tolerances),
                                           tolerances = tolerances_of("--tolerance", r.tolerances);
    std::vector<Effort> list;
    for (const std::string& dt : steps) {
        for (const auto& [substeps, iterations] : work) {
            for (const std::optional<Real>& residual : residuals) {
                for (const std::optional<Real>& tolerance : tolerances) list.push_back({dt, substeps, iterations, residual, tolerance});
            }
        }
    }
    return list;
}

std::vector<std::optional<SolverChoice>> solvers_of(const EngineChoice& engine, const BenchRequest& r) {
    if (engine.name != "cairn" || !engine.path.empty()) return {{}};
    std::vector<std::string> names = split(r.solvers);
    if (names.empty())
        names = r.full ? std::vector<std::string>{"auto", "si", "direct", "rattle", "mixed", "tgs"} : std::vector<std::string>{"auto"};
    std::vector<std::optional<SolverChoice>> solvers;
    for (const std::string& name : names) {
        RunArguments arguments;
        arguments.solver = name;
        solvers.push_back(run_options(arguments).solver);
    }
    return solvers;
}

std::vector<EngineChoice> engines_of(const BenchRequest& r) {
    if (r.engines == "none") return parse_engines("", r.external);
    if (!r.engines.empty()) return parse_engines(r.engines, r.external);
    // Of each other engine the best it has: double precision, default solver. The variants are there by name.
    std::string found = "cairn";
    const std::vector<std::string> known = engine_names();
    for (const char* name : {"bullet64", "ode"}) {
        if (std::find(known.begin(), known.end(), name) != known.end()) found += std::string(",") + name;
    }
    return parse_engines(found, r.external);
}

std::vector<int> threads_of(const BenchRequest& r) {
    std::vector<int> threads;
    for (const std::optional<int>& n : whole_numbers("--threads", r.threads.empty() ? "1" : r.threads)) threads.push_back(n.value_or(1));
    return threads;
}

// Keeps every n-th case, from the i-th.
std::vector<BenchCase> shard_of(std::vector<BenchCase> cases, const std::string& shard) {
    int i = 0, n = 0;
    const std::size_t slash = shard.find('/');
    const char* end = shard.data() + shard.size();
    const bool well = slash != std::string::npos && std::from_chars(shard.data(), shard.data() + slash, i).ptr == shard.data() + slash &&
                      std::from_chars(shard.data() + slash + 1, end, n).ptr == end && i >= 1 && i <= n;
    if (!well) throw_invalid("--shard", shard, "I/N with 1 <= I <= N");
    std::vector<BenchCase> kept;
    for (std::size_t k = static_cast<std::size_t>(i - 1); k < cases.size(); k += static_cast<std::size_t>(n))
        kept.push_back(std::move(cases[k]));
    return kept;
}

}  // namespace

std::string BenchCase::id() const {
    const auto number = [](const std::optional<int>& x) { return x ? std::to_string(*x) : std::string("default"); };
    std::string id = fmt::format("{} {} dt={} substeps={} iterations={}", file->scene.name, engine.name, dt, number(settings.substeps),
                                 number(settings.iterations));
    if (settings.solver) id += fmt::format(" solver={}", solver_name(*settings.solver));
    if (settings.residual_tolerance) id += fmt::format(" residual={}", *settings.residual_tolerance);
    if (settings.tolerance) id += fmt::format(" tolerance={}", *settings.tolerance);
    if (settings.threads != 1) id += fmt::format(" threads={}", settings.threads);
    if (settings.sleep) id += " sleep";
    return id;
}

std::string BenchCase::command() const {
    // Shipped and generated scenes go by name, wherever they are on this machine.
    const std::string& path = file->path;
    const bool by_name = path.empty() || fs::path(path) == fs::path(shipped_scene_folder()) / (file->scene.name + ".json");
    std::string text = fmt::format("cairn bench --scene {} --dt {}", by_name ? file->scene.name : path, dt);
    text += engine.path.empty() ? fmt::format(" --engines {}", engine.name)
                                : fmt::format(" --engines none --engine {}={}", engine.name, engine.path);
    if (settings.solver) text += fmt::format(" --solver {}", solver_name(*settings.solver));
    if (settings.substeps) text += fmt::format(" --substeps {}", *settings.substeps);
    if (settings.iterations) text += fmt::format(" --iterations {}", *settings.iterations);
    if (settings.residual_tolerance) text += fmt::format(" --residual-tolerance {}", *settings.residual_tolerance);
    if (settings.tolerance) text += fmt::format(" --tolerance {}", *settings.tolerance);
    if (settings.threads != 1) text += fmt::format(" --threads {}", settings.threads);
    if (settings.sleep) text += " --sleep 1";
    return text;
}

double BenchCase::cost() const {
    const double per_step = static_cast<double>(file->scene.bodies.size() + 5) * settings.substeps.value_or(engine.name == "cairn" ? 4 : 1);
    return per_step * std::max(1.0, std::round(file->scene.duration / settings.dt));
}

std::vector<BenchCase> plan_cases(const BenchRequest& r) {
    const std::vector<EngineChoice> engines = engines_of(r);
    const std::vector<Effort> work = efforts(r);
    const std::vector<int> all_threads = threads_of(r);
    std::vector<BenchCase> cases;
    for (const std::shared_ptr<const SceneFile>& file : chosen_scenes(r)) {
        for (const Effort& effort : work) {
            for (const EngineChoice& engine : engines) {
                for (const std::optional<SolverChoice>& solver : solvers_of(engine, r)) {
                    if ((effort.residual_tolerance || effort.tolerance) && engine.name != "cairn") continue;
                    EngineSettings s;
                    s.dt = parse_time_step(effort.dt);
                    s.substeps = effort.substeps;
                    s.iterations = effort.iterations;
                    s.residual_tolerance = effort.residual_tolerance;
                    s.tolerance = effort.tolerance;
                    s.solver = solver;
                    s.sleep = r.sleep;
                    for (const int threads : engine.name == "cairn" && engine.path.empty() ? all_threads : std::vector<int>{1}) {
                        s.threads = threads;
                        cases.push_back({file, engine, s, effort.dt, static_cast<int>(cases.size())});
                    }
                }
            }
        }
    }
    if (cases.empty()) throw Error("bench: nothing to run");
    return r.shard.empty() ? cases : shard_of(std::move(cases), r.shard);
}

}  // namespace cairn::cli
