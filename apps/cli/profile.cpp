#include "apps/cli/profile.hpp"

#include "apps/cli/options.hpp"
#include "apps/cli/report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>

namespace cairn::cli {

namespace {

constexpr const char* kPhaseNames[kPhases] = {"broad phase", "narrow phase", "islands", "rows", "solve", "store", "integrate", "sleep"};
constexpr const char* kPhaseKeys[kPhases] = {"broad_phase", "narrow_phase", "islands", "rows", "solve", "store", "integrate", "sleep"};
constexpr const char* kShapeNames[kShapeTypes] = {"sphere", "box", "capsule", "cylinder", "hull", "plane", "mesh"};

struct NamedSum {
    const char* key;
    std::uint64_t RunProfile::*sum;
};
constexpr NamedSum kSums[] = {{"proxies_moved", &RunProfile::proxies_moved},
                              {"pairs_begun", &RunProfile::pairs_begun},
                              {"pairs_ended", &RunProfile::pairs_ended},
                              {"pairs", &RunProfile::pairs},
                              {"manifolds", &RunProfile::manifolds},
                              {"contacts", &RunProfile::contacts},
                              {"manifolds_reused", &RunProfile::manifolds_reused},
                              {"queries", &RunProfile::queries},
                              {"separating_axis_hits", &RunProfile::separating_axis_hits},
                              {"fcl_calls", &RunProfile::fcl_calls},
                              {"normal_rows", &RunProfile::normal_rows},
                              {"friction_rows", &RunProfile::friction_rows},
                              {"joint_rows", &RunProfile::joint_rows},
                              {"contact_sweeps", &RunProfile::contact_sweeps},
                              {"joint_sweeps", &RunProfile::joint_sweeps},
                              {"factorisations", &RunProfile::factorisations},
                              {"free_bodies", &RunProfile::free_bodies},
                              {"sleeping_bodies", &RunProfile::sleeping_bodies},
                              {"allocations", &RunProfile::allocations}};

template <class Visit>
void for_each_pair_type(const RunProfile& p, Visit visit) {
    for (int i = 0; i < kShapeTypes; ++i)
        for (int j = i; j < kShapeTypes; ++j)
            if (p.queries_of[i][j] > 0)
                visit(fmt::format("{}-{}", kShapeNames[i], kShapeNames[j]), p.queries_of[i][j], p.fcl_calls_of[i][j]);
}

double measured(const RunProfile& p) {
    double sum = 0;
    for (const double s : p.seconds) sum += s;
    return sum;
}

}  // namespace

void RunProfile::add(const StepReport& r, double step_wall, std::uint64_t step_allocations) {
    const StepProfile& s = *r.profile;
    ++steps;
    wall += step_wall;
    for (int k = 0; k < kPhases; ++k) seconds[k] += s.seconds[k];
    for (int i = 0; i < kShapeTypes; ++i) {
        for (int j = 0; j < kShapeTypes; ++j) {
            queries_of[i][j] += s.queries_of[i][j];
            fcl_calls_of[i][j] += s.fcl_calls_of[i][j];
        }
    }
    for (int k = 0; k < kSolverChoices; ++k) islands_of[k] += r.islands_of[k];
    proxies_moved += s.proxies_moved;
    pairs_begun += s.pairs_begun;
    pairs_ended += s.pairs_ended;
    separating_axis_hits += s.separating_axis_hits;
    pairs += r.pairs;
    manifolds += r.manifolds;
    contacts += r.contacts;
    manifolds_reused += r.manifolds_reused;
    queries += r.narrow_queries;
    fcl_calls += r.fcl_calls;
    normal_rows += r.normal_rows;
    friction_rows += r.friction_rows;
    joint_rows += r.joint_rows;
    contact_sweeps += r.contact_sweeps;
    joint_sweeps += r.joint_sweeps;
    factorisations += r.factorisations;
    free_bodies += r.free_bodies;
    sleeping_bodies += r.sleeping_bodies;
    allocations += step_allocations;
}

const std::vector<const char*>& phase_keys() {
    static const std::vector<const char*> keys = [] {
        std::vector<const char*> list(std::begin(kPhaseKeys), std::end(kPhaseKeys));
        list.push_back("rest");
        return list;
    }();
    return keys;
}

std::string profile_table(const RunProfile& p) {
    const double wall = std::max(p.wall, 1e-12), steps = static_cast<double>(std::max(p.steps, 1L));
    std::string text = fmt::format("profile of {} steps{:>22}{:>12}{:>8}\n", p.steps, "total", "a step", "share");
    const auto time_row = [&](const char* name, double seconds) {
        text += fmt::format("  {:<31} {:>11} {:>11} {:>6.1f}%\n", name, readable_time(seconds), readable_time(seconds / steps),
                            100 * seconds / wall);
    };
    for (int k = 0; k < kPhases; ++k) time_row(kPhaseNames[k], p.seconds[k]);
    time_row("the rest", std::max(0.0, p.wall - measured(p)));
    text += fmt::format("  {:<31} {:>11}\n", "counts, a step on average", "");
    const auto count_row = [&](const std::string& name, std::uint64_t count) {
        if (count > 0) text += fmt::format("    {:<29} {:>11.4g}\n", name, static_cast<double>(count) / steps);
    };
    for (const NamedSum& s : kSums) {
        std::string name = s.key;
        std::replace(name.begin(), name.end(), '_', ' ');
        count_row(name, p.*s.sum);
    }
    for (int k = 0; k < kSolverChoices; ++k)
        count_row(fmt::format("islands solved by {}", solver_name(static_cast<SolverChoice>(k))), p.islands_of[k]);
    for_each_pair_type(p, [&](const std::string& name, std::uint64_t queries, std::uint64_t calls) {
        count_row(name + " queries", queries);
        count_row(name + " calls of FCL", calls);
    });
    return text;
}

nlohmann::ordered_json profile_json(const RunProfile& p) {
    nlohmann::ordered_json out;
    for (int k = 0; k < kPhases; ++k) out["seconds"][kPhaseKeys[k]] = p.seconds[k];
    out["seconds"]["rest"] = std::max(0.0, p.wall - measured(p));
    for (const NamedSum& s : kSums) out["counts"][s.key] = p.*s.sum;
    for (int k = 0; k < kSolverChoices; ++k) out["islands"][solver_name(static_cast<SolverChoice>(k))] = p.islands_of[k];
    out["pair_types"] = nlohmann::ordered_json::object();
    for_each_pair_type(p, [&](const std::string& name, std::uint64_t queries, std::uint64_t calls) {
        out["pair_types"][name] = {{"queries", queries}, {"fcl_calls", calls}};
    });
    return out;
}

}  // namespace cairn::cli
