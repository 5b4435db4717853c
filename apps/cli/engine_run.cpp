#include "apps/cli/engine_run.hpp"

#include "apps/cli/external_run.hpp"
#include "engine/base/hash.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

namespace cairn::cli {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

// Steps an engine of ours or of an adapter to the end of the scene. `run` holds what was done even when this throws.
void run_built_in(const EngineChoice& engine, const Scene& scene, const EngineSettings& settings, EngineRun& run) {
    const std::unique_ptr<Rival> rival = make_engine(engine.name, scene, settings);
    run.version = rival->version();
    run.precision = rival->precision();
    run.settings = rival->settings();
    const long steps = step_count(scene.duration, settings.dt);
    const std::vector<long> due = sample_steps(scene.sample_interval, settings.dt, steps);
    const auto sample = [&](Real t) {
        run.history.t.push_back(t);
        rival->states(run.history.states.emplace_back());
    };
    sample(0);
    std::vector<double> walls;
    walls.reserve(static_cast<std::size_t>(steps));
    std::size_t next = 0;
    for (long step = 1; step <= steps; ++step) {
        const Clock::time_point start = Clock::now();
        rival->step(settings.dt);
        walls.push_back(seconds_since(start));
        run.wall_total += walls.back();
        run.steps = step;
        run.contacts_max = std::max(run.contacts_max, rival->contacts());
        if (step != due[next]) continue;
        ++next;
        sample(static_cast<Real>(step) * settings.dt);
    }
    run.phases = rival->phases();
    if (!run.phases.empty()) {
        double rest = run.wall_total;
        for (const double s : run.phases) rest -= s;
        run.phases.push_back(std::max(0.0, rest));
    }
    run.wall_max_step = *std::max_element(walls.begin(), walls.end());
    const std::ptrdiff_t half = static_cast<std::ptrdiff_t>(walls.size() / 2);
    std::nth_element(walls.begin(), walls.begin() + half, walls.end());
    run.wall_median_step = walls[static_cast<std::size_t>(half)];
}

// One run as bytes: a line of JSON with everything but the samples, then the samples' numbers.
std::string pack(const EngineRun& r) {
    nlohmann::json head = {{"status", static_cast<int>(r.status)},
                           {"note", r.note},
                           {"version", r.version},
                           {"settings", r.settings},
                           {"precision", r.precision},
                           {"steps", r.steps},
                           {"wall", {r.wall_total, r.wall_median_step, r.wall_max_step}},
                           {"phases", r.phases},
                           {"contacts", r.contacts_max},
                           {"samples", r.history.t.size()},
                           {"bodies", r.history.states.empty() ? 0 : r.history.states.front().size()}};
    std::string bytes = head.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + '\n';
    const auto put = [&bytes](Real x) { bytes.append(reinterpret_cast<const char*>(&x), sizeof x); };
    for (std::size_t k = 0; k < r.history.t.size(); ++k) {
        put(r.history.t[k]);
        for (const BodyState& s : r.history.states[k]) {
            for (int i = 0; i < 3; ++i) put(s.position[i]);
            for (int i = 0; i < 4; ++i) put(s.rotation.coeffs()[i]);
            for (int i = 0; i < 3; ++i) put(s.linear_velocity[i]);
            for (int i = 0; i < 3; ++i) put(s.angular_velocity[i]);
        }
    }
    return bytes;
}

bool unpack(const std::string& bytes, EngineRun& r) {
    const std::size_t line = bytes.find('\n');
    if (line == std::string::npos) return false;
    const nlohmann::json head = nlohmann::json::parse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(line), nullptr, false);
    if (!head.is_object()) return false;
    r.status = static_cast<RunStatus>(head["status"].get<int>());
    r.note = head["note"];
    r.version = head["version"];
    r.settings = head["settings"];
    r.precision = head["precision"];
    r.steps = head["steps"];
    // A time that is not finite travels as null.
    const auto wall = [&head](std::size_t i) { return head["wall"][i].is_number() ? head["wall"][i].get<double>() : 0; };
    r.wall_total = wall(0);
    r.wall_median_step = wall(1);
    r.wall_max_step = wall(2);
    r.phases = head["phases"].get<std::vector<double>>();
    r.contacts_max = head["contacts"];
    const std::size_t samples = head["samples"], bodies = head["bodies"];
    const char* at = bytes.data() + line + 1;
    if (bytes.size() - line - 1 != samples * (1 + 13 * bodies) * sizeof(Real)) return false;
    Hasher hasher;
    const auto get = [&] {
        Real x;
        std::memcpy(&x, at, sizeof x);
        at += sizeof x;
        hasher.add(x);
        return x;
    };
    r.history.t.resize(samples);
    r.history.states.assign(samples, std::vector<BodyState>(bodies));
    for (std::size_t k = 0; k < samples; ++k) {
        r.history.t[k] = get();
        for (BodyState& s : r.history.states[k]) {
            for (int i = 0; i < 3; ++i) s.position[i] = get();
            for (int i = 0; i < 4; ++i) s.rotation.coeffs()[i] = get();
            for (int i = 0; i < 3; ++i) s.linear_velocity[i] = get();
            for (int i = 0; i < 3; ++i) s.angular_velocity[i] = get();
        }
    }
    r.state_hash = hasher.value();
    return true;
}

void write_all(int pipe, const std::string& bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t wrote = ::write(pipe, bytes.data() + done, bytes.size() - done);
        if (wrote < 0 && errno != EINTR) return;
        if (wrote > 0) done += static_cast<std::size_t>(wrote);
    }
}

// The child's part: run, send, end without running this program's exit handlers.
[[noreturn]] void child_main(int pipe, const EngineChoice& engine, const SceneFile& file, const EngineSettings& settings) {
    ::setpgid(0, 0);  // so that a timeout also ends what an external runner has started
    EngineRun run;
    try {
        if (engine.path.empty()) {
            run_built_in(engine, file.scene, settings, run);
        } else {
            run_external(engine, file, settings, run);
        }
    } catch (const Unsupported& error) {
        run.status = RunStatus::kUnsupported;
        run.note = error.what();
    } catch (const std::exception& error) {
        run.status = RunStatus::kFailed;
        run.note = error.what();
    } catch (...) {
        run.status = RunStatus::kFailed;
        run.note = "an exception of an unknown type";
    }
    write_all(pipe, pack(run));
    ::_exit(0);
}

// The run under way has a process group of its own (child_main), which a break of this program does not reach by itself.
volatile std::sig_atomic_t running_group = 0;

extern "C" void end_with_child(int signal) {
    if (running_group > 0) ::kill(-static_cast<pid_t>(running_group), SIGKILL);
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

void end_with_this_program(pid_t child) {
    running_group = child;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        const auto before = std::signal(signal, end_with_child);
        if (before == SIG_IGN) std::signal(signal, SIG_IGN);  // as under nohup
    }
}

// What the child sends until it ends; false if the time ran out.
bool read_all(int pipe, double timeout, std::string& bytes) {
    const Clock::time_point start = Clock::now();
    char buffer[65536];
    for (;;) {
        const double left = timeout - seconds_since(start);
        if (left <= 0) return false;
        pollfd wait = {pipe, POLLIN, 0};
        if (::poll(&wait, 1, static_cast<int>(std::min(1000 * left, 1e9)) + 1) <= 0) continue;
        const ssize_t got = ::read(pipe, buffer, sizeof buffer);
        if (got == 0) return true;
        if (got > 0) bytes.append(buffer, static_cast<std::size_t>(got));
    }
}

}  // namespace

const char* to_string(RunStatus status) {
    switch (status) {
        case RunStatus::kOk:
            return "ok";
        case RunStatus::kUnsupported:
            return "unsupported";
        case RunStatus::kFailed:
            return "failed";
        case RunStatus::kCrashed:
            return "crashed";
        case RunStatus::kTimeout:
            return "timeout";
    }
    return "unknown";
}

std::vector<EngineChoice> parse_engines(const std::string& names, const std::vector<std::string>& external) {
    std::vector<EngineChoice> engines;
    const std::vector<std::string> known = engine_names();
    std::size_t start = 0;
    while (start < names.size()) {
        const std::size_t comma = std::min(names.find(',', start), names.size());
        const std::string name = names.substr(start, comma - start);
        start = comma + 1;
        if (std::find(known.begin(), known.end(), name) == known.end()) {
            throw_invalid("--engines", name, fmt::format("one of {}", fmt::join(known, ", ")));
        }
        engines.push_back({name, ""});
    }
    for (const std::string& pair : external) {
        const std::size_t equals = pair.find('=');
        if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size()) throw_invalid("--engine", pair, "NAME=PATH");
        engines.push_back({pair.substr(0, equals), pair.substr(equals + 1)});
    }
    return engines;
}

EngineRun run_engine(const EngineChoice& engine, const SceneFile& file, const EngineSettings& settings, double timeout) {
    int ends[2];
    if (::pipe(ends) != 0) throw Error(std::string("a pipe cannot be made: ") + std::strerror(errno));
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child < 0) throw Error(std::string("a process cannot be made: ") + std::strerror(errno));
    if (child == 0) {
        ::close(ends[0]);
        child_main(ends[1], engine, file, settings);
    }
    ::setpgid(child, child);  // as the child does: whoever is first
    end_with_this_program(child);
    ::close(ends[1]);
    std::string bytes;
    const bool in_time = read_all(ends[0], timeout, bytes);
    ::close(ends[0]);
    if (!in_time) {
        ::kill(-child, SIGKILL);
        ::kill(child, SIGKILL);
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    running_group = 0;
    EngineRun run;
    if (!in_time) {
        run.status = RunStatus::kTimeout;
        run.note = fmt::format("not done after {:.3g} s", timeout);
    } else if (!unpack(bytes, run)) {
        run = {};
        run.status = RunStatus::kCrashed;
        run.note = WIFSIGNALED(status) ? fmt::format("ended by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                                       : fmt::format("ended with {}", WEXITSTATUS(status));
    }
    return run;
}

}  // namespace cairn::cli
