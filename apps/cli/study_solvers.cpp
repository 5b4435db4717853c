// 1g, 1h: accumulated impulses, warm starts, and other ways to sweep.
#include "apps/cli/report.hpp"
#include "apps/cli/study.hpp"
#include "apps/cli/study_run.hpp"
#include "apps/cli/study_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::cli {

namespace {

StudyModel per_iteration(int sweeps) {
    StudyModel m = textbook("per-iteration clamp", sweeps);
    m.settings.model.clamp = Clamp::kPerIteration;
    return m;
}

StudyModel over_relaxed(StudyModel m, Real relaxation) {
    m.name += fmt::format(", over-relaxed {}", relaxation);
    m.settings.model.relaxation = relaxation;
    return m;
}

StudyModel conjugate(StudyModel m) {
    m.name += ", NNCG";
    m.settings.model.method = SweepMethod::kNncg;
    return m;
}

// Natural-map residual [m/s] of the first step after a number of sweeps.
StudyCurve convergence(const Scene& scene, StudyModel model, int most) {
    StudyCurve curve{model.name, "linespoints lw 2", "1:2", {}};
    for (int sweeps = 1; sweeps <= most; sweeps *= 2) {
        model.settings.iterations = sweeps;
        StudyRun run(scene, model);
        run.step();
        curve.points.push_back({static_cast<Real>(sweeps), std::max(run.report().natural_residual, 1e-16)});
    }
    return curve;
}

}  // namespace

void study_accumulated(StudyReport& s, bool quick) {
    s.say(
        "The accumulated clamp bounds the sum of a row's corrections in the step, so a later sweep may take back what an earlier one gave "
        "too "
        "much. The sum starts at zero in each step (`--warm-start off`), or where the manifold cache says that this point ended in the "
        "last "
        "step: in a stack at rest that is the answer already, and the sweeps of many steps add up to one long solve. Over-relaxation "
        "takes each correction 1.3 times; NNCG (Silcowitz, Niebe, Erleben 2010) reads a sweep as a gradient step and carries on along "
        "conjugate "
        "directions.");
    const Real duration = quick ? 8 : 60;
    const Scene shifted = sheet_scene("sheet_shifted_stack");
    StudyTable& t = s.table("1g_stack", fmt::format("The shifted stack of 1f without friction, {} s.", duration), kStandingColumns);
    std::string results[2][2];
    for (const int sweeps : {10, 200}) {
        std::vector<StudyModel> models = {
            per_iteration(sweeps), textbook("accumulated, from zero", sweeps), textbook_warm("accumulated, warm", sweeps),
            over_relaxed(textbook_warm("accumulated, warm", sweeps), 1.3), conjugate(textbook_warm("accumulated, warm", sweeps))};
        for (std::size_t k = 0; k < models.size(); ++k) {
            StudyModel& m = models[k];
            m.name += fmt::format(", {} sweeps", sweeps);
            m.settings.model.friction = FrictionModel::kNone;
            t.row(standing_row(m, stand(shifted, m, duration, 0.5)));
            if (k == 1 || k == 2) results[sweeps == 10 ? 0 : 1][k - 1] = t.rows.back()[1];
        }
    }
    StudyTable& ten = s.table("1g_ten", fmt::format("Ten aligned boxes with friction, {} s.", duration), kStandingColumns);
    for (const int sweeps : {10, 30, 100}) {
        for (StudyModel m : {textbook("accumulated, from zero", sweeps), textbook_warm("accumulated, warm", sweeps)}) {
            m.name += fmt::format(", {} sweeps", sweeps);
            ten.row(standing_row(m, stand(box_stack(10), m, duration, 0.5)));
        }
    }
    ten.row(standing_row(default_si(), stand(box_stack(10), default_si(), duration, 0.5)));
    StudyFigure& f =
        s.figure("1g_convergence",
                 "The shifted stack without friction, first step from zero impulses: natural-map residual over the number of sweeps.",
                 "set xlabel 'sweeps'\nset ylabel 'residual [m/s]'\nset logscale xy\nset format y '10^{%L}'\nset key left bottom");
    const int most = quick ? 1024 : 4096;
    for (StudyModel m : {per_iteration(1), textbook("accumulated clamp"), over_relaxed(textbook("accumulated"), 1.3),
                         conjugate(textbook("accumulated"))}) {
        m.settings.model.friction = FrictionModel::kNone;
        f.curves.push_back(convergence(shifted, m, most));
    }
    s.conclude(fmt::format(
        "With ten sweeps the shifted stack: from zero {}, warm {}; with 200 sweeps: from zero {}, warm {}. After {} sweeps of one step "
        "the residual is {} m/s with the per-iteration clamp, {} with the accumulated one, {} over-relaxed, {} with NNCG.",
        results[0][0], results[0][1], results[1][0], results[1][1], static_cast<int>(f.curves[0].points.back()[0]),
        number(f.curves[0].points.back()[1]), number(f.curves[1].points.back()[1]), number(f.curves[2].points.back()[1]),
        number(f.curves[3].points.back()[1])));
}

void study_strengths(StudyReport& s, bool quick) {
    s.say(
        "Sequential impulses are cheap per sweep, never add energy in a converged step and stop anywhere with something usable. Their "
        "weakness "
        "is how slowly news travel: a sweep carries it as far as the order of the rows allows, so tall stacks, and light bodies between "
        "heavy ones, need many sweeps.");
    struct Case {
        const char* name;
        Scene scene;
        Real limit;
    };
    const std::vector<Case> cases = {{"20 boxes", box_stack(20), 0.5},
                                     {"shifted stack", sheet_scene("sheet_shifted_stack"), 0.5},
                                     {"pyramid of 55", sheet_scene("pyramid_10"), 0.25},
                                     {"card house", sheet_scene("card_house"), 0.1},
                                     {"1 kg under 100 kg", sheet_scene("sheet_light_heavy"), 0.5}};
    const std::vector<StudyModel> models = {textbook_warm("textbook, warm, 10 sweeps"),
                                            over_relaxed(textbook_warm("textbook, warm, 10 sweeps"), 1.3),
                                            conjugate(textbook_warm("textbook, warm, 10 sweeps")),
                                            default_si(),
                                            default_auto(),
                                            bullet()};
    const Real duration = quick ? 4 : 20;
    StudyTable& t = s.table("1h_cases", fmt::format("{} s each.", duration), kStandingColumns);
    t.columns.insert(t.columns.begin(), "scene");
    std::vector<int> standing(models.size(), 0);
    for (const Case& c : cases) {
        for (std::size_t k = 0; k < models.size(); ++k) {
            const Standing r = stand(c.scene, models[k], duration, c.limit);
            standing[k] += r.stands();
            std::vector<std::string> row = standing_row(models[k], r);
            row.insert(row.begin(), c.name);
            t.row(row);
        }
    }
    std::string sentence;
    for (std::size_t k = 0; k < models.size(); ++k) {
        if (is_available(models[k])) sentence += fmt::format("{}{}: {}", sentence.empty() ? "" : "; ", models[k].name, standing[k]);
    }
    s.conclude(fmt::format("Of {} scenes stand: {}.", cases.size(), sentence));
}

}  // namespace cairn::cli
