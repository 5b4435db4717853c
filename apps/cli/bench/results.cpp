#include "apps/cli/bench/results.hpp"

#include "apps/cli/bench/order.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/profile.hpp"
#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/events.hpp"
#include "apps/cli/truths/soundness.hpp"
#include "engine/base/error.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

namespace cairn::cli {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Json number(double x) {
    return std::isfinite(x) ? Json(x) : Json(nullptr);
}
double number(const Json& j) {
    return j.is_number() ? j.get<double>() : kNone;
}

Json to_json(const BenchRow& r) {
    return {{"id", r.id},
            {"place", r.place},
            {"scene", r.scene},
            {"bodies", r.bodies},
            {"engine", r.engine},
            {"version", r.version},
            {"precision", r.precision},
            {"solver", r.solver},
            {"dt", r.dt},
            {"dt_text", r.dt_text},
            {"substeps", r.substeps},
            {"iterations", r.iterations},
            {"threads", r.threads},
            {"status", r.status},
            {"note", r.note},
            {"truth", r.truth},
            {"metric", r.metric},
            {"unit", r.unit},
            {"error", number(r.error)},
            {"path_metric", r.path_metric},
            {"path_error", number(r.path_error)},
            {"energy_gain", number(r.energy_gain)},
            {"steps", r.steps},
            {"contacts", r.contacts},
            {"walls_s", r.walls},
            {"step_medians_s", r.step_medians},
            {"phases_s", r.phases},
            {"instructions", r.instructions},
            {"state_hash", r.state_hash},
            {"same_states", r.same_states},
            {"settings", r.settings},
            {"command", r.command}};
}

BenchRow row_from(const Json& j) {
    BenchRow r;
    r.id = j.at("id");
    r.place = j.value("place", 0);
    r.scene = j.at("scene");
    r.bodies = j.at("bodies");
    r.engine = j.at("engine");
    r.version = j.at("version");
    r.precision = j.at("precision");
    r.solver = j.at("solver");
    r.dt = j.at("dt");
    r.dt_text = j.at("dt_text");
    r.substeps = j.at("substeps");
    r.iterations = j.at("iterations");
    r.threads = j.value("threads", 1);
    r.status = j.at("status");
    r.note = j.at("note");
    r.truth = j.at("truth");
    r.metric = j.at("metric");
    r.unit = j.at("unit");
    r.error = number(j.at("error"));
    r.path_metric = j.value("path_metric", "");
    r.path_error = j.contains("path_error") ? number(j["path_error"]) : kNone;
    r.energy_gain = number(j.at("energy_gain"));
    r.steps = j.at("steps");
    r.contacts = j.at("contacts");
    r.walls = j.at("walls_s").get<std::vector<double>>();
    r.step_medians = j.at("step_medians_s").get<std::vector<double>>();
    r.phases = j.value("phases_s", std::vector<double>{});
    r.instructions = j.value("instructions", 0.0);
    r.state_hash = j.at("state_hash");
    r.same_states = j.at("same_states");
    r.settings = j.at("settings");
    r.command = j.at("command");
    return r;
}

Json to_json(const Order& o) {
    return {{"scene", o.scene}, {"engine", o.label},      {"metric", o.metric}, {"order", number(o.order)},
            {"steps", o.steps}, {"coarsest", o.coarsest}, {"finest", o.finest}, {"overall", number(o.overall)},
            {"note", o.note}};
}

Json to_json(const Machine& m) {
    return {{"cpu", m.cpu},     {"cores", m.cores},   {"system", m.system}, {"compiler", m.compiler},
            {"flags", m.flags}, {"commit", m.commit}, {"date", m.date}};
}
Machine machine_from(const Json& j) {
    return {j.at("cpu"), j.at("cores"), j.at("system"), j.at("compiler"), j.at("flags"), j.at("commit"), j.at("date")};
}

// Written beside the file and renamed, so that a file by this name is always whole.
void write_file(const fs::path& path, const std::string& text) {
    const fs::path part = path.string() + ".part";
    std::ofstream file(part, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw Error(path.string() + ": cannot be written");
    fs::rename(part, path);
}

std::string csv_text(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + '"';
}

// The order of convergence of each row's series, of its path's where it has one: "" without.
std::map<std::string, const Order*> orders_by_id(const std::vector<BenchRow>& rows, const std::vector<Order>& orders) {
    std::map<std::string, const Order*> of_series, found;
    for (const Order& order : orders) of_series[order.series] = &order;
    for (const BenchRow& row : with_paths(rows)) {
        const auto order = of_series.find(series_of(row));
        if (order != of_series.end()) found[row.id] = order->second;
    }
    return found;
}

std::string csv_of(const std::vector<BenchRow>& rows, const std::vector<Order>& orders) {
    std::string text =
        "scene,bodies,engine,version,precision,solver,dt,substeps,iterations,threads,status,truth,metric,unit,error,path_error,order,"
        "order_of_steps,energy_gain,steps,contacts,wall_median_s,wall_spread,step_median_s,repeats,instructions";
    for (const char* phase : phase_keys()) text += fmt::format(",{}_s", phase);
    text += ",state_hash,same_states,note,settings,command\n";
    const std::map<std::string, const Order*> order_of = orders_by_id(rows, orders);
    for (const BenchRow& r : rows) {
        const auto order = order_of.find(r.id);
        text += fmt::format("{},{},{},{},{},{},{:.17g},{},{},{},{},{},{},{},{:.9g},{:.9g},", csv_text(r.scene), r.bodies,
                            csv_text(r.engine), csv_text(r.version), r.precision, r.solver, r.dt, r.substeps, r.iterations, r.threads,
                            r.status, r.truth, csv_text(r.metric), r.unit, r.error, r.path_error);
        if (order == order_of.end()) {
            text += ",,";
        } else {
            text += fmt::format("{:.4g},{},", order->second->order, csv_text(to_text(*order->second)));
        }
        text += fmt::format("{:.6g},{},{},{:.6g},{:.3g},{:.6g},{},{:.0f}", r.energy_gain, r.steps, r.contacts, r.wall_median(), r.spread(),
                            r.step_median(), r.walls.size(), r.instructions);
        for (std::size_t k = 0; k < phase_keys().size(); ++k) {
            text += r.phases.size() == phase_keys().size() ? fmt::format(",{:.6g}", r.phases[k]) : std::string(",");
        }
        text += fmt::format(",{},{},{},{},{}\n", r.state_hash, r.same_states ? 1 : 0, csv_text(r.note), csv_text(r.settings),
                            csv_text(r.command));
    }
    return text;
}

// The head is a line with the machine; then a line each time a case has been run, the last of a case holding all its repeats.
std::map<std::string, BenchRow> read_lines(const fs::path& path, Machine& machine) {
    std::map<std::string, BenchRow> rows;
    std::ifstream file(path);
    bool head = true;
    for (std::string line; std::getline(file, line);) {
        const Json j = Json::parse(line, nullptr, false);
        if (j.is_discarded()) continue;  // cut off by a break
        if (head) {
            machine = machine_from(j.at("machine"));
            head = false;
        } else {
            BenchRow r = row_from(j);
            rows[r.id] = std::move(r);
        }
    }
    return rows;
}

}  // namespace

double BenchRow::wall_median() const {
    return walls.empty() ? 0 : median(walls);
}
double BenchRow::step_median() const {
    return step_medians.empty() ? 0 : median(step_medians);
}
double BenchRow::spread() const {
    if (walls.empty()) return 0;
    const auto [low, high] = std::minmax_element(walls.begin(), walls.end());
    return wall_median() > 0 ? (*high - *low) / wall_median() : 0;
}

void run_case(const BenchCase& c, double timeout, BenchRow& row) {
    const Scene& scene = c.file->scene;
    const EngineRun run = run_engine(c.engine, *c.file, c.settings, timeout);
    const std::string hash = fmt::format("{:016x}", run.state_hash);
    const bool first = row.status.empty();
    if (!first) {
        row.same_states = row.same_states && hash == row.state_hash;
    } else {
        row.id = c.id();
        row.place = c.place;
        row.command = c.command();
        row.scene = scene.name;
        row.engine = c.engine.name;
        row.version = run.version;
        row.precision = run.precision;
        row.solver = c.settings.solver ? solver_name(*c.settings.solver) : "";
        row.dt_text = c.dt;
        row.dt = c.settings.dt;
        row.substeps = c.settings.substeps.value_or(0);
        row.iterations = c.settings.iterations.value_or(0);
        row.settings = run.settings;
        row.bodies = static_cast<int>(scene.bodies.size());
        row.status = to_string(run.status);
        row.note = run.note;
        row.steps = run.steps;
        row.contacts = run.contacts_max;
        row.state_hash = hash;
        row.threads = c.settings.threads;
        row.error = row.path_error = row.energy_gain = kNone;
        const Truth truth = truth_of(scene);
        row.truth = to_string(truth.kind);
        if (run.status == RunStatus::kOk) {
            if (const std::string reason = unsound(scene, run.history); !reason.empty()) {
                row.status = "failed";
                row.note = reason;
            }
            if (is_whole(scene, run.history)) {
                const TruthError error = truth.error(scene, run.history);
                row.metric = error.what;
                row.unit = error.unit;
                row.error = error.value;
                row.energy_gain = energy_gain(scene, run.history);
                if (truth.path != nullptr) {
                    const TruthError path = truth.path(scene, run.history);
                    row.path_metric = path.what;
                    row.path_error = path.value;
                }
                if (!error.failed.empty() && row.status == "ok") {
                    row.status = "failed";
                    row.note = error.failed;
                }
                if (row.status == "ok") {
                    row.note = missing_event(scene, run.history);
                    if (!row.note.empty()) row.status = "failed";
                }
            }
        }
    }
    if (run.status == RunStatus::kOk) {
        row.walls.push_back(run.wall_total);
        row.step_medians.push_back(run.wall_median_step);
    }
}

void measure_phases(const BenchCase& c, double timeout, BenchRow& row) {
    EngineSettings settings = c.settings;
    settings.profile = true;
    const EngineRun run = run_engine(c.engine, *c.file, settings, timeout);
    if (run.status == RunStatus::kOk) row.phases = run.phases;
}

ResultFolder::ResultFolder(const std::string& path, const Machine& machine, bool mixed) : path_(path), machine_(machine) {
    if (path_.empty()) return;
    std::error_code error;
    fs::create_directories(path_, error);
    if (!fs::is_directory(path_)) throw Error("--out: " + path_ + ": cannot be made a folder: " + error.message());
    const fs::path lines = fs::path(path_) / "rows.jsonl";
    if (fs::exists(lines)) {
        Machine before;
        rows_ = read_lines(lines, before);
        const bool same = before.commit == machine.commit && before.cpu == machine.cpu && before.flags == machine.flags;
        if (!rows_.empty() && !same && !mixed) {
            throw Error("--out: " + path_ + ": holds results of commit " + before.commit + " on " + before.cpu +
                        "; take another folder, or --mixed to add to them all the same");
        }
        if (!rows_.empty()) return;
    }
    std::ofstream(lines) << Json{{"machine", to_json(machine_)}}.dump() << '\n';
}

int ResultFolder::done(const std::string& id) const {
    const auto found = rows_.find(id);
    if (found == rows_.end()) return 0;
    // What failed is not asked again.
    return found->second.walls.empty() ? 1 << 20 : static_cast<int>(found->second.walls.size());
}

BenchRow& ResultFolder::row(const std::string& id) {
    return rows_[id];
}

void ResultFolder::keep(const BenchRow& row) {
    if (path_.empty()) return;
    std::ofstream file(fs::path(path_) / "rows.jsonl", std::ios::app);
    file << to_json(row).dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
    if (!file) throw Error("--out: " + path_ + ": cannot be written");
}

void ResultFolder::finish(const std::vector<std::string>& order) const {
    if (path_.empty()) return;
    std::vector<BenchRow> rows;
    for (const std::string& id : order) {
        if (const auto found = rows_.find(id); found != rows_.end()) rows.push_back(found->second);
    }
    for (const auto& [id, row] : rows_) {
        if (std::find(order.begin(), order.end(), id) == order.end()) rows.push_back(row);
    }
    const std::vector<Order> orders = orders_of(rows);
    Json all;
    all["format"] = "cairn-bench/1";
    all["machine"] = to_json(machine_);
    all["rows"] = Json::array();
    for (const BenchRow& row : rows) all["rows"].push_back(to_json(row));
    all["orders"] = Json::array();
    for (const Order& o : orders) all["orders"].push_back(to_json(o));
    write_file(fs::path(path_) / "results.json", all.dump(1, ' ', false, Json::error_handler_t::replace) + '\n');
    write_file(fs::path(path_) / "results.csv", csv_of(rows, orders));
}

std::vector<BenchRow> read_result_file(const std::string& path, Machine& machine) {
    std::ifstream file(path);
    const Json all = Json::parse(file, nullptr, false);
    if (!all.is_object() || all.value("format", "") != "cairn-bench/1") throw Error(path + ": is no results.json of cairn bench");
    machine = machine_from(all.at("machine"));
    std::vector<BenchRow> rows;
    for (const Json& j : all.at("rows")) rows.push_back(row_from(j));
    return rows;
}

std::vector<BenchRow> read_results(const std::string& folder, std::vector<Machine>& machines) {
    std::vector<fs::path> parts;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, error)) {
        if (entry.path().filename() == "rows.jsonl") parts.push_back(entry.path());
    }
    std::sort(parts.begin(), parts.end());
    std::vector<BenchRow> rows;
    std::map<std::string, std::size_t> at;
    for (const fs::path& part : parts) {
        Machine machine;
        std::map<std::string, BenchRow> found = read_lines(part, machine);
        machines.push_back(machine);
        for (auto& [id, row] : found) {
            const auto [place, fresh] = at.emplace(id, rows.size());
            if (fresh) {
                rows.push_back(std::move(row));
            } else {
                rows[place->second] = std::move(row);  // a later folder replaces an earlier one
            }
        }
    }
    std::stable_sort(rows.begin(), rows.end(), [](const BenchRow& a, const BenchRow& b) { return a.place < b.place; });
    if (rows.empty()) throw Error(folder + ": holds no results of cairn bench");
    return rows;
}

}  // namespace cairn::cli
