#include "apps/cli/step_report_file.hpp"

#include "apps/cli/options.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <iterator>

namespace cairn::cli {

namespace {

struct EnergyPart {
    const char* key;
    Real StepEnergy::*part;
};
constexpr EnergyPart kEnergy[] = {{"kinetic_change", &StepEnergy::kinetic_change},
                                  {"potential_change", &StepEnergy::potential_change},
                                  {"gravity", &StepEnergy::gravity},
                                  {"applied", &StepEnergy::applied},
                                  {"driven", &StepEnergy::driven},
                                  {"impacts", &StepEnergy::impacts},
                                  {"friction", &StepEnergy::friction},
                                  {"joints", &StepEnergy::joints},
                                  {"stabilisation", &StepEnergy::stabilisation},
                                  {"sleep", &StepEnergy::sleep},
                                  {"remainder", &StepEnergy::remainder}};

constexpr const char* kHead =
    "t,islands,rows,residual_max,residual_rms,worst_row,worst_body_a,worst_body_b,joint_error,joint_error_at,joint_angle,joint_angle_at,"
    "penetration,penetration_a,penetration_b";

bool ends_with(const std::string& text, const std::string& end) {
    return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

nlohmann::ordered_json residual_json(const World& world, const StepResidual& r) {
    return {{"max", r.max},
            {"rms", r.rms},
            {"rows", r.rows},
            {"worst_row", to_string(r.worst)},
            {"body_a", body_name(world, r.body_a)},
            {"body_b", body_name(world, r.body_b)}};
}

nlohmann::ordered_json island_json(const World& world, const IslandReport& i) {
    nlohmann::ordered_json out = {{"first_body", body_name(world, i.first_body)},
                                  {"bodies", i.bodies},
                                  {"joints", i.joints},
                                  {"contacts", i.contacts},
                                  {"rows", i.rows},
                                  {"solver", solver_name(i.solver)},
                                  {"reason", to_string(i.reason)}};
    if (i.fell_back_from != SolverChoice::kAuto) out["fell_back_from"] = solver_name(i.fell_back_from);
    out["substeps"] = i.substeps;
    out["iterations"] = i.iterations;
    out["residual"] = residual_json(world, i.residual);
    return out;
}

nlohmann::ordered_json step_json(Real t, const Scene& scene, const World& world, const StepDiagnostics& d) {
    nlohmann::ordered_json out = {{"t", t}, {"residual", residual_json(world, d.residual)}};
    out["joint_error"] = {{"position", d.joint_error},
                          {"position_at", joint_name(scene, d.joint_error_at)},
                          {"angle", d.joint_angle},
                          {"angle_at", joint_name(scene, d.joint_angle_at)}};
    out["penetration"] = {
        {"depth", d.penetration}, {"body_a", body_name(world, d.penetration_a)}, {"body_b", body_name(world, d.penetration_b)}};
    for (const EnergyPart& e : kEnergy) out["energy"][e.key] = d.energy.*e.part;
    out["islands"] = nlohmann::ordered_json::array();
    for (const IslandReport& island : d.islands) out["islands"].push_back(island_json(world, island));
    return out;
}

}  // namespace

std::string body_name(const World& world, BodyId body) {
    return body.is_world() ? std::string() : world.name(body);
}

std::string joint_name(const Scene& scene, const JointId& joint) {
    if (joint.index >= scene.joints.size()) return {};
    const SceneJoint& j = scene.joints[joint.index];
    const auto name = [&](const std::optional<std::size_t>& body) { return body ? scene.bodies[*body].name : std::string("the world"); };
    return fmt::format("{} joint of {} and {}", to_string(j.def.type), name(j.body_a), name(j.body_b));
}

StepReportFile::StepReportFile(const std::string& path)
    : file_("--report", path), json_(ends_with(path, ".json") || ends_with(path, ".jsonl")) {
    if (json_) return;
    row_ = kHead;
    for (const EnergyPart& e : kEnergy) row_.append(",").append(e.key);
    file_.write(row_ + '\n');
}

void StepReportFile::write_step(Real t, const Scene& scene, const SceneWorld& built, const StepReport& report) {
    const StepDiagnostics& d = *report.diagnostics;
    const World& world = built.world;
    if (json_) {
        file_.write(step_json(t, scene, world, d).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + '\n');
        return;
    }
    row_.clear();
    fmt::format_to(std::back_inserter(row_), "{:.17g},{},{},{:.6g},{:.6g},{},{},{},{:.6g},{},{:.6g},{},{:.6g},{},{}", t, d.islands.size(),
                   d.residual.rows, d.residual.max, d.residual.rms, to_string(d.residual.worst), body_name(world, d.residual.body_a),
                   body_name(world, d.residual.body_b), d.joint_error, joint_name(scene, d.joint_error_at), d.joint_angle,
                   joint_name(scene, d.joint_angle_at), d.penetration, body_name(world, d.penetration_a),
                   body_name(world, d.penetration_b));
    for (const EnergyPart& e : kEnergy) fmt::format_to(std::back_inserter(row_), ",{:.17g}", d.energy.*e.part);
    file_.write(row_ + '\n');
}

}  // namespace cairn::cli
