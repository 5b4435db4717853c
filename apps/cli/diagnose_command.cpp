#include "apps/cli/commands.hpp"
#include "apps/cli/diagnose/diagnose.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/shipped_scenes.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <memory>

namespace cairn::cli {

namespace {

struct Arguments {
    std::string scene;
    RunArguments run;
    bool json = false;
    bool quiet = false;
};

// What was measured, whether or not anything is wrong: the largest of each.
struct Measured {
    Real moved = 0, stretch = 0, twist = 0, sink = 0, residual = 0;
    std::size_t resting = 0;
};

Measured measured_in(const Evidence& e) {
    Measured m;
    for (const BodyEvidence& b : e.bodies) {
        if (!b.should_rest) continue;
        ++m.resting;
        m.moved = std::max(m.moved, b.moved);
    }
    for (const JointEvidence& j : e.joints) {
        m.stretch = std::max(m.stretch, j.error);
        m.twist = std::max(m.twist, j.angle);
    }
    for (const PairEvidence& p : e.pairs) m.sink = std::max(m.sink, p.late_depth);
    for (const GroupEvidence& g : e.groups) m.residual = std::max(m.residual, g.residual);
    return m;
}

std::string measured_text(const Measured& m) {
    std::string text;
    const auto row = [&text](const char* name, const std::string& value) { text += fmt::format("  {:<28} {}\n", name, value); };
    row("bodies that should rest",
        fmt::format("{}{}", m.resting, m.resting > 0 ? fmt::format(", and move {:.3g} m at most", m.moved) : ""));
    row("joints", fmt::format("apart by {:.3g} m and {:.3g} rad at most", m.stretch, m.twist));
    row("contacts", fmt::format("{:.3g} m deep at most, on average over the last quarter", m.sink));
    row("residual", fmt::format("{:.3g} m/s at most of a row", m.residual));
    return text;
}

std::string finding_text(const Finding& f, const Scene& scene) {
    std::string text;
    text += (f.cause == "overlap" ? f.says : symptom_text(*f.symptom, scene)) + ".\n";
    text += f.cause == "overlap" ? "  cause (overlap): the scene puts them there; they are pushed apart\n"
                                 : fmt::format("  cause ({}): {}\n", f.cause, f.says);
    for (const Trial& t : f.trials)
        text += fmt::format("  tried {}: {} before, {} after{}\n", t.says, number_text(*f.symptom, f.symptom->value),
                            number_text(*f.symptom, t.after), t.cured ? ": cured" : "");
    const bool cured = std::any_of(f.trials.begin(), f.trials.end(), [](const Trial& t) { return t.cured; });
    if (!f.no_cure.empty()) {
        text += "  " + f.no_cure + '\n';
    } else if (!cured) {
        text += "  nothing that was tried cured it\n";
    }
    return text;
}

nlohmann::ordered_json finding_json(const Finding& f, const Scene& scene) {
    nlohmann::ordered_json out = {{"cause", f.cause}, {"says", f.says}, {"bodies", f.bodies}};
    out["symptom"] = f.cause == "overlap" ? f.says : symptom_text(*f.symptom, scene);
    out["unit"] = f.symptom->kind == SymptomKind::kTwists ? "rad" : f.symptom->kind == SymptomKind::kBreaks ? "" : "m";
    out["before"] = f.symptom->value;
    out["limit"] = f.symptom->limit;
    out["cured_by"] = nullptr;
    out["tried"] = nlohmann::ordered_json::array();
    for (const Trial& t : f.trials) {
        out["tried"].push_back({{"setting", t.says}, {"after", t.after}, {"cured", t.cured}});
        if (t.cured) out["cured_by"] = t.says;
    }
    if (!f.no_cure.empty()) out["no_cure"] = f.no_cure;
    return out;
}

void print_json(const Scene& scene, const RunOptions& options, const Evidence& e, const std::vector<Finding>& findings) {
    const Measured m = measured_in(e);
    nlohmann::ordered_json line = {{"scene", scene.name}, {"dt", options.dt}};
    line["measured"] = {{"resting_bodies", m.resting}, {"moved", m.moved},      {"joint_error", m.stretch},
                        {"joint_angle", m.twist},      {"penetration", m.sink}, {"residual", m.residual}};
    line["findings"] = nlohmann::ordered_json::array();
    for (const Finding& f : findings) line["findings"].push_back(finding_json(f, scene));
    if (!e.refused.empty()) line["refused"] = e.refused;
    fmt::print("{}\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

void print_text(const Scene& scene, const Evidence& e, const std::vector<Finding>& findings) {
    if (!e.refused.empty()) fmt::print("{}: the run was stopped: {}\n", scene.name, e.refused);
    if (findings.empty()) fmt::print("{}: nothing wrong found\n", scene.name);
    for (const Finding& f : findings) fmt::print("{}: {}", scene.name, finding_text(f, scene));
    fmt::print("measured\n{}", measured_text(measured_in(e)));
}

int diagnose(const Arguments& a) {
    const RunOptions options = run_options(a.run);
    const Scene scene = load_scene(find_scene(a.scene));
    Evidence evidence;
    {
        Progress progress(!a.quiet && !a.json);
        evidence = observe(scene, options, [&](long done, long all) { progress.update(done, all); });
    }
    const Case c{scene, options, evidence};
    std::vector<Finding> findings = find_causes(c);
    for (Finding& f : findings) try_cures(c, f);
    a.json ? print_json(scene, options, evidence, findings) : print_text(scene, evidence, findings);
    return findings.empty() && evidence.refused.empty() ? kSuccess : kRunFailed;
}

}  // namespace

void add_diagnose_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("diagnose", "Run a scene and say why it fails, and what cures it");
    const std::shared_ptr<Arguments> a = std::make_shared<Arguments>();
    command->add_option("SCENE", a->scene, "A scene file, or the name of a shipped scene (see: cairn list)")->required();
    add_run_options(*command, a->run);
    command->add_flag("--json", a->json, "Print one line of JSON");
    command->add_flag("--quiet", a->quiet, "No progress");
    command->footer(
        "Looks for bodies that should rest but move, joints that stretch and contacts that stay deep; for their causes; and tries cures "
        "by\n"
        "running them (docs/diagnose.md).\n"
        "Examples:\n"
        "  cairn diagnose my_stack.json --solver si\n"
        "  cairn diagnose my_chain.json --dt 1/30 --json\n"
        "Exit codes: 0 nothing wrong found, 1 something is wrong, 2 bad arguments or files.");
    command->callback([a, &exit_code] { exit_code = diagnose(*a); });
}

}  // namespace cairn::cli
