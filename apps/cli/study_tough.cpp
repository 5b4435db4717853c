// 2e, 2f: how far it goes, and the maze.
#include "apps/cli/report.hpp"
#include "apps/cli/study.hpp"
#include "apps/cli/study_run.hpp"
#include "apps/cli/study_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::cli {

namespace {

StudyModel plain_pyramid() {
    return textbook("textbook from zero, 10 sweeps");
}

std::vector<StudyModel> compared() {
    StudyModel each = textbook("per-iteration clamp, 10 sweeps");
    each.settings.model.clamp = Clamp::kPerIteration;
    StudyModel relaxed = textbook_warm("textbook, warm, over-relaxed 1.3");
    relaxed.settings.model.relaxation = 1.3;
    StudyModel conjugate = textbook_warm("textbook, warm, NNCG");
    conjugate.settings.model.method = SweepMethod::kNncg;
    StudyModel soft = textbook_warm("soft, 4 substeps of 1 sweep", 1);
    soft.settings.stabilisation = Stabilisation::kSoft;
    soft.settings.substeps = 4;
    soft.settings.model.friction = FrictionModel::kPyramid;
    return {each,           plain_pyramid(), textbook_warm("textbook, warm, 10 sweeps"), relaxed, conjugate, soft, default_si(),
            default_auto(), bullet()};
}

// Mean distance [m] of the balls between two runs' states.
Real mean_distance(const Scene& scene, const std::vector<BodyState>& a, const std::vector<BodyState>& b) {
    Real sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (scene.bodies[i].type != BodyType::kDynamic) continue;
        sum += (a[i].position - b[i].position).norm();
        ++count;
    }
    return count > 0 ? sum / count : 0;
}

}  // namespace

void study_limits(StudyReport& s, bool quick) {
    const Real duration = quick ? 6 : 60;
    const int most = quick ? 24 : 64;
    s.say(fmt::format(
        "The most unit boxes of 1 kg that stand for {} s, found by doubling and bisection up to {} (a box counts as fallen when it is "
        "0.5 m from where it started); then one box of 1 kg with one on it that is up to a million times heavier.",
        duration, most));
    StudyTable& t = s.table("2e_stack", fmt::format("Unit boxes stacked for {} s.", duration),
                            {"model", "boxes", "drift of the highest that stood [m]", "time a step"});
    std::vector<StudyModel> models = compared();
    int best = -1, worst = most + 1;
    std::string best_name, worst_name;
    for (const StudyModel& m : models) {
        if (!is_available(m)) {
            t.row({m.name, "not in this build", "–", "–"});
            continue;
        }
        Standing last;
        const int n = largest_standing(most, [&](int count) {
            const Standing r = stand(box_stack(count), m, duration, 0.5);
            if (r.stands()) last = r;
            return r.stands();
        });
        t.row({m.name, n == most ? fmt::format("{} (all that was tried)", n) : std::to_string(n), number(last.drift),
               readable_time(last.step_time)});
        if (n > best) best = n, best_name.clear();
        if (n == best) best_name += (best_name.empty() ? "" : "; ") + m.name;
        if (n < worst) worst = n, worst_name.clear();
        if (n == worst) worst_name += (worst_name.empty() ? "" : "; ") + m.name;
    }
    std::vector<std::string> columns = {"model"};
    const int powers = 6;
    for (int k = 0; k <= powers; ++k) columns.push_back(fmt::format("1:10^{}", k));
    const Real while_heavy = quick ? 4 : 60;
    StudyTable& heavy = s.table("2e_heavy", fmt::format("A heavy box on a box of 1 kg: drift [m] after {} s.", while_heavy), columns);
    std::string ratios;
    for (const StudyModel& m : models) {
        std::vector<std::string> row = {m.name};
        int held = -1;
        bool all_before = true;
        for (int k = 0; k <= powers; ++k) {
            const Standing r = stand(heavy_on_light(std::pow(10.0, k)), m, while_heavy, 0.5);
            row.push_back(!r.available ? "–" : r.fell_at >= 0 ? fmt::format("falls at {:.1f} s", r.fell_at) : number(r.drift));
            all_before = all_before && r.stands();
            if (all_before) held = k;
        }
        heavy.row(row);
        if (is_available(m) && held >= 0) ratios += fmt::format("{}{}: 1:10^{}", ratios.empty() ? "" : "; ", m.name, held);
    }
    s.conclude(
        fmt::format("Most boxes: {} ({}). Fewest: {} ({}). Mass ratios that stand: {}.", best, best_name, worst, worst_name, ratios));
}

void study_maze(StudyReport& s, bool quick) {
    s.say(
        "Balls on a board with walls and a hole that tilts to and fro. The game comes later; here the scene runs in each engine, beside "
        "Cairn "
        "with a sixteenth of the step as the reference. Balls that hit walls make small differences grow, so the early distances say more "
        "than the late ones.");
    Scene scene = sheet_scene("maze_small");
    const Real duration = quick ? std::min(scene.duration, 5.0) : scene.duration;
    StudyModel reference = default_si();
    reference.dt /= 16;
    std::vector<std::vector<BodyState>> truth;
    StudyRun exact(scene, reference);
    while (exact.time() < duration - 1e-9) {
        for (int k = 0; k < 16; ++k) exact.step();
        truth.push_back(exact.states());
    }
    const std::size_t board = body_index(scene, "board");
    const Real floor = scene.bodies[board].position.z() - 1;
    StudyTable& t = s.table("2f_maze", fmt::format("maze_small, {} s.", duration),
                            {"model", "balls on the board", "mean distance after 1 s [m]", "after 2 s [m]", "at the end [m]",
                             "deepest point [m]", "time a step"});
    StudyFigure& f = s.figure("2f_maze", "Mean distance of the balls from the reference.",
                              "set xlabel 't [s]'\nset ylabel 'distance [m]'\nset logscale y\nset key right bottom");
    StudyModel pyramid = plain_pyramid();
    std::string sentence;
    for (const StudyModel& m : {pyramid, textbook_warm("textbook, warm, 10 sweeps"), default_si(), default_auto(), bullet()}) {
        if (!is_available(m)) {
            t.row({m.name, "not in this build", "–", "–", "–", "–", "–"});
            continue;
        }
        StudyCurve curve{m.name, "lines lw 2", "1:2", {}};
        StudyRun run(scene, m);
        Real one = 0, two = 0, end = 0, deepest = 0;
        for (const std::vector<BodyState>& at : truth) {
            run.step();
            end = mean_distance(scene, run.states(), at);
            if (run.time() < 1.001) one = end;
            if (run.time() < 2.001) two = end;
            deepest = std::max(deepest, run.report().max_penetration);
            curve.points.push_back({run.time(), std::max(end, 1e-9)});
        }
        int on_board = 0;
        for (std::size_t i = 0; i < scene.bodies.size(); ++i)
            on_board += scene.bodies[i].type == BodyType::kDynamic && run.states()[i].position.z() > floor;
        f.curves.push_back(curve);
        t.row({m.name, std::to_string(on_board), number(one), number(two), number(end), m.engine.empty() ? number(deepest) : "–",
               readable_time(run.median_step())});
        sentence += fmt::format("{}{} {} m", sentence.empty() ? "" : ", ", m.name, number(two));
    }
    s.conclude(fmt::format("After 2 s the balls are on average this far from the reference: {}.", sentence));
}

}  // namespace cairn::cli
