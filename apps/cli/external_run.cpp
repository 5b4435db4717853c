#include "apps/cli/external_run.hpp"

#include "engine/base/error.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

namespace cairn::cli {

namespace fs = std::filesystem;

namespace {

std::string read_whole(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// A folder for one run, gone with it.
class Scratch {
public:
    Scratch() {
        std::string name = (fs::temp_directory_path() / "cairn-run-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr) throw Error(name + ": cannot be made: " + std::strerror(errno));
        folder_ = name;
    }
    ~Scratch() {
        std::error_code ignored;
        fs::remove_all(folder_, ignored);
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    std::string file(const char* name) const { return (folder_ / name).string(); }

private:
    fs::path folder_;
};

// Runs a program with its standard output in a file; returns its exit code, −1 if it was killed.
int run_program(std::vector<std::string> words, const std::string& output) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int failed = ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) throw Error(words[0] + ": cannot be started: " + std::strerror(failed));
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// The last line that is a JSON object; null without one.
nlohmann::json runner_line_of(const std::string& output) {
    nlohmann::json found;
    std::size_t start = 0;
    while (start < output.size()) {
        const std::size_t end = std::min(output.find('\n', start), output.size());
        if (output[start] == '{') {
            nlohmann::json line = nlohmann::json::parse(output.begin() + static_cast<std::ptrdiff_t>(start),
                                                        output.begin() + static_cast<std::ptrdiff_t>(end), nullptr, false);
            if (line.is_object()) found = std::move(line);
        }
        start = end + 1;
    }
    return found;
}

}  // namespace

void run_external(const EngineChoice& engine, const SceneFile& file, const EngineSettings& s, EngineRun& run) {
    const Scratch scratch;
    std::string scene_path = file.path;
    if (scene_path.empty()) {
        scene_path = scratch.file("scene.json");
        std::ofstream(scene_path, std::ios::binary) << file.text;
    }
    std::vector<std::string> words = {engine.path, scene_path,          "--dt",     fmt::format("{:.17g}", s.dt),
                                      "--sleep",   s.sleep ? "1" : "0", "--states", scratch.file("states.csv")};
    if (s.substeps) words.insert(words.end(), {"--substeps", std::to_string(*s.substeps)});
    if (s.iterations) words.insert(words.end(), {"--iterations", std::to_string(*s.iterations)});
    const int code = run_program(std::move(words), scratch.file("output"));
    const nlohmann::json line = runner_line_of(read_whole(scratch.file("output")));
    if (code == 3) {
        std::string missing;
        if (line.is_object() && line.contains("unsupported")) missing = line["unsupported"].dump();
        throw Unsupported(missing.empty() ? "something in the scene" : missing);
    }
    if (code != 0) throw Error(fmt::format("ended with {}", code));
    if (!line.is_object()) throw Error("no runner line");
    run.version = line.value("version", "");
    run.precision = line.value("precision", 64);
    run.steps = line.value("steps", 0L);
    run.wall_total = line.value("wall_total_s", 0.0);
    run.wall_median_step = line.value("wall_median_step_s", 0.0);
    run.wall_max_step = line.value("wall_max_step_s", 0.0);
    run.contacts_max = -1;
    run.settings = fmt::format("{} substeps, {} iterations", line.value("substeps", 0), line.value("iterations", 0));
    if (line.contains("settings")) run.settings += ", " + line["settings"].dump();
    run.history = read_states(read_whole(scratch.file("states.csv")), file.scene);
}

History read_states(const std::string& text, const Scene& scene) {
    constexpr int kColumns = 13;
    std::map<std::string, std::size_t, std::less<>> index;
    std::vector<BodyState> start;
    for (const BodyDef& body : scene.bodies) {
        index.emplace(body.name, start.size());
        start.push_back({body.position, body.rotation, body.linear_velocity, body.angular_velocity});
    }
    History history;
    const char* at = text.data();
    const char* const end = at + text.size();
    for (long row = 1; at < end; ++row) {
        const char* line_end = std::find(at, end, '\n');
        const std::string_view line(at, static_cast<std::size_t>(line_end - at));
        at = line_end == end ? end : line_end + 1;
        if (row == 1 || line.empty()) continue;
        const std::size_t comma = line.find(','), second = line.find(',', comma + 1);
        Real t = 0, x[kColumns];
        bool well = second != std::string_view::npos && std::from_chars(line.data(), line.data() + comma, t).ec == std::errc();
        const char* number = line.data() + second + 1;
        for (int k = 0; k < kColumns && well; ++k) {
            const std::from_chars_result read = std::from_chars(number, line_end, x[k]);
            well = read.ec == std::errc();
            number = read.ptr + 1;
        }
        if (!well) throw Error(fmt::format("states, line {}: cannot be read", row));
        const auto body = index.find(line.substr(comma + 1, second - comma - 1));
        if (body == index.end()) continue;
        if (history.t.empty() || t > history.t.back()) {
            history.t.push_back(t);
            history.states.push_back(start);
        }
        history.states.back()[body->second] = {
            {x[0], x[1], x[2]}, Quat(x[3], x[4], x[5], x[6]).normalized(), {x[7], x[8], x[9]}, {x[10], x[11], x[12]}};
    }
    if (history.t.empty()) throw Error("states: none");
    return history;
}

}  // namespace cairn::cli
