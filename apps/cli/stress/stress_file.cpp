#include "apps/cli/stress/stress_file.hpp"

#include "engine/base/error.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>

namespace cairn::cli {

using Json = nlohmann::ordered_json;

void write_stress(const std::string& folder, const Machine& m, const std::vector<StressRow>& rows) {
    Json all = {
        {"format", "cairn-stress/1"},
        {"machine",
         {{"cpu", m.cpu}, {"cores", m.cores}, {"compiler", m.compiler}, {"flags", m.flags}, {"commit", m.commit}, {"date", m.date}}},
        {"limits", Json::array()}};
    for (const StressRow& row : rows) {
        const LimitResult& r = row.result;
        all["limits"].push_back({{"limit", r.limit},
                                 {"what", row.what},
                                 {"unit", row.unit},
                                 {"criterion", row.criterion},
                                 {"engine", r.engine},
                                 {"solver", r.solver},
                                 {"held", r.held},
                                 {"rungs", r.rungs},
                                 {"value", r.value},
                                 {"failed_value", r.failed_value},
                                 {"failed_at", r.failed_at},
                                 {"held_command", r.held_command},
                                 {"failed_command", r.failed_command},
                                 {"note", r.note}});
    }
    std::ofstream file(std::filesystem::path(folder) / "stress.json", std::ios::binary);
    file << all.dump(1, ' ', false, Json::error_handler_t::replace) << '\n';
    file.close();
    if (!file) throw Error(folder + "/stress.json: cannot be written");
}

std::vector<StressRow> read_stress(const std::string& folder) {
    std::vector<StressRow> rows;
    std::ifstream file(std::filesystem::path(folder) / "stress.json");
    if (!file) return rows;
    const Json all = Json::parse(file, nullptr, false);
    if (!all.is_object() || all.value("format", "") != "cairn-stress/1") throw Error(folder + "/stress.json: is no result of cairn stress");
    for (const Json& j : all.at("limits")) {
        StressRow& row = rows.emplace_back();
        row.what = j.at("what");
        row.unit = j.at("unit");
        row.criterion = j.at("criterion");
        LimitResult& r = row.result;
        r.limit = j.at("limit");
        r.engine = j.at("engine");
        r.solver = j.at("solver");
        r.held = j.at("held");
        r.rungs = j.at("rungs");
        r.value = j.at("value");
        r.failed_value = j.at("failed_value");
        r.failed_at = j.at("failed_at");
        r.held_command = j.at("held_command");
        r.failed_command = j.at("failed_command");
        r.note = j.at("note");
    }
    return rows;
}

}  // namespace cairn::cli
