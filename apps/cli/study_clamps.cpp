// 1lcp, 1d, 1e, 1f: what each condition on the normal impulse is good for.
#include "apps/cli/report.hpp"
#include "apps/cli/study.hpp"
#include "apps/cli/study_run.hpp"
#include "apps/cli/study_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::cli {

namespace {

StudyModel with(StudyModel model, Clamp clamp) {
    model.settings.model.clamp = clamp;
    return model;
}

StudyModel with(StudyModel model, Stabilisation stabilisation) {
    model.settings.stabilisation = stabilisation;
    return model;
}

// Over-relaxation by nothing to speak of keeps `split` in the textbook's substep, so that one thing alone differs.
StudyModel in_textbook(StudyModel model) {
    model.settings.model.relaxation = 1 + 1e-12;
    return model;
}

// Friction belongs to the sheet's second part.
StudyModel frictionless(const std::string& name, int sweeps = 10) {
    StudyModel m = textbook(name, sweeps);
    m.settings.model.friction = FrictionModel::kNone;
    return m;
}

// Height of the body's centre [m] over time.
StudyCurve height_curve(const Scene& scene, const StudyModel& model, const std::string& body, Real duration) {
    StudyCurve curve{model.name, "lines lw 2", "1:2", {}};
    const std::size_t i = body_index(scene, body);
    StudyRun run(scene, model);
    curve.points.push_back({0, run.states()[i].position.z()});
    while (run.time() < duration - 1e-9) {
        run.step();
        curve.points.push_back({run.time(), run.states()[i].position.z()});
    }
    return curve;
}

// Outlines of the boxes in the x, z plane, a closed line each.
StudyCurve outlines(const std::string& title, const Scene& scene, const std::vector<BodyState>& states, Real offset) {
    StudyCurve curve{title, "lines lw 2", "1:2", {}};
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        if (scene.bodies[i].shapes.front().type != ShapeType::kBox) continue;
        const Vec3 h = scene.bodies[i].shapes.front().half_extents;
        for (const auto& sign : {Vec3(1, 0, 1), Vec3(-1, 0, 1), Vec3(-1, 0, -1), Vec3(1, 0, -1), Vec3(1, 0, 1)}) {
            const Vec3 p = states[i].position + states[i].rotation * sign.cwiseProduct(h);
            curve.points.push_back({p.x() + offset, p.z()});
        }
        curve.points.emplace_back();
    }
    return curve;
}

// Largest angular velocity [rad/s] that the first step leaves, for a number of sweeps.
Real spin_left(const Scene& scene, StudyModel model, int sweeps) {
    model.settings.iterations = sweeps;
    StudyRun run(scene, model);
    run.step();
    Real spin = 0;
    for (const BodyState& s : run.states()) spin = std::max(spin, s.angular_velocity.norm());
    return spin;
}

}  // namespace

void study_complementarity(StudyReport& s, bool) {
    s.say(
        "0 ≤ λ ⊥ C ≥ 0 has three parts, and two of them can be left out to see what they are for. **Without λ ≥ 0** (`--clamp none`) the "
        "row "
        "is the equation Ċ = 0 and pulls as well as it pushes: what touches is glued. **Without λ C = 0** (`--complementarity off`) a gap "
        "that "
        "is open may take an impulse: the row asks for Ċ ≥ 0 wherever the collision stage reports a pair, and stops a body in the air.");
    const StudyModel right = textbook("all three conditions");
    StudyModel glue = with(textbook("without λ ≥ 0"), Clamp::kNone);
    StudyModel apart = textbook("without λ C = 0");
    apart.settings.model.complementarity = false;
    const Scene lift = sheet_scene("sheet_lift"), drop = sheet_scene("sheet_drop");
    const StudyCurve lifted = height_curve(lift, right, "box", 0.3), glued = height_curve(lift, glue, "box", 0.3);
    const StudyCurve landed = height_curve(drop, right, "ball", 2), hovering = height_curve(drop, apart, "ball", 2);
    const auto rise = [](const StudyCurve& c) {
        Real top = 0;
        for (const auto& p : c.points) top = std::max(top, p[1] - c.points.front()[1]);
        return top;
    };
    const Real free_rise = 4 / (2 * 9.81), hover = hovering.points.back()[1] - 0.5, rest = landed.points.back()[1] - 0.5;
    StudyTable& t = s.table("1lcp", "A box that starts upwards at 2 m/s from the ground; a ball that falls from 1 m above it.",
                            {"scene", "model", "result [m]", "truth [m]"});
    t.row({"box: rise", right.name, number(rise(lifted)), number(free_rise)});
    t.row({"box: rise", glue.name, number(rise(glued)), number(free_rise)});
    t.row({"ball: gap at rest", right.name, number(rest), "0"});
    t.row({"ball: gap at rest", apart.name, number(hover), "0"});
    StudyFigure& f =
        s.figure("1lcp_ball", "Height of the falling ball's centre (0.5 m: on the ground): without λ C = 0 it is stopped in the air.",
                 "set xlabel 't [s]'\nset ylabel 'height of the centre [m]'");
    f.curves = {landed, hovering};
    s.conclude(
        fmt::format("Without λ ≥ 0 the box that should rise by {} m rises by {} m; without λ C = 0 the ball comes to rest {} m above the "
                    "ground.",
                    number(free_rise), number(rise(glued)), number(hover)));
}

void study_iteration_clamp(StudyReport& s, bool quick) {
    s.say(
        "Each correction Δ = −S⁻¹(G v − target) is applied only if it is positive (`--clamp per-iteration`). One contact alone is solved "
        "by one sweep, and a ball on a plane is one contact. A correction that was right when it was made can be too large once the "
        "neighbours have made theirs, and this clamp cannot take it back; but where boxes are aligned and start at rest, every sweep finds "
        "each row still falling, and no correction wants to be negative. (The residual is the natural map of the contact problem, not "
        "the last change of a sweep: a clamp that changes nothing any more looks converged.)");
    const Real duration = quick ? 5 : 10;
    StudyTable& t =
        s.table("1d_clamp", fmt::format("{} s; 100 sweeps, target velocity, impulses start at zero in each step, no friction.", duration),
                kStandingColumns);
    t.columns.insert(t.columns.begin(), "scene");
    Real worst_ball = 0, drift[2] = {0, 0};
    for (const char* name : {"sheet_ball", "sheet_stack"}) {
        const bool is_ball = std::string(name) == "sheet_ball";
        for (const Clamp clamp : {Clamp::kPerIteration, Clamp::kAccumulated}) {
            const bool each = clamp == Clamp::kPerIteration;
            const StudyModel m = with(frictionless(each ? "per-iteration clamp" : "accumulated clamp", 100), clamp);
            const Standing r = stand(sheet_scene(name), m, duration, 0.5);
            std::vector<std::string> row = standing_row(m, r);
            row.insert(row.begin(), is_ball ? "ball on a plane" : "five boxes, aligned");
            t.row(row);
            if (is_ball) worst_ball = std::max(worst_ball, r.drift);
            if (!is_ball) drift[each ? 0 : 1] = r.drift;
        }
    }
    s.conclude(fmt::format(
        "The ball stays within {} m with either clamp; the aligned stack drifts {} m with the per-iteration clamp and {} m with "
        "the accumulated one: {}.",
        number(worst_ball), number(drift[0]), number(drift[1]),
        std::abs(drift[0] - drift[1]) < 0.01 * drift[1] ? "aligned boxes do not tell them apart" : "they differ already"));
}

void study_stabilisation(StudyReport& s, bool quick) {
    s.say(
        "A velocity constraint does not know that C is already negative: errors of rounding, of linearisation and of sweeps that were too "
        "few add up. The target velocity −β C_N/h, only where C_N < 0, takes a share β = 0.2 of a penetration back in a step. It is real "
        "velocity, so a body that starts deep inside leaves with it; `split` moves positions by a push that is forgotten afterwards, "
        "`soft` forgets the springs' velocity in a sweep without them.");
    const Real duration = quick ? 5 : 20;
    StudyTable& stack =
        s.table("1e_stack",
                fmt::format("Five boxes, {} s, ten sweeps from zero impulses: what the sweeps miss in a step stays without it.", duration),
                kStandingColumns);
    std::string without, with_target;
    for (const auto& [name, how] : {std::pair{"none", Stabilisation::kNone}, std::pair{"target velocity", Stabilisation::kTargetVelocity},
                                    std::pair{"split", Stabilisation::kSplit}, std::pair{"soft", Stabilisation::kSoft}}) {
        const StudyModel m = in_textbook(with(textbook(name), how));
        const std::vector<std::string> row = standing_row(m, stand(sheet_scene("sheet_stack"), m, duration, 0.5));
        stack.row(row);
        if (how == Stabilisation::kNone) without = row[1];
        if (how == Stabilisation::kTargetVelocity) with_target = row[1] + " (drift " + row[2] + " m)";
    }
    const Scene sunk = sheet_scene("sheet_sunk");
    StudyTable& t = s.table("1e_sunk", "A box that starts 50 mm deep in the ground.",
                            {"model", "within 1 mm after [s]", "largest speed upwards [m/s]", "highest above rest [m]"});
    StudyFigure& f = s.figure("1e_sunk", "Height of the sunk box above its resting height.", "set xlabel 't [s]'\nset ylabel 'height [m]'");
    Real pop = 0;
    for (const auto& [name, how] : {std::pair{"none", Stabilisation::kNone}, std::pair{"target velocity", Stabilisation::kTargetVelocity},
                                    std::pair{"split", Stabilisation::kSplit}, std::pair{"soft", Stabilisation::kSoft}}) {
        const StudyModel m = in_textbook(with(textbook(name), how));
        Real recovered = -1, speed = 0, highest = -1;
        StudyCurve curve{name, "lines lw 2", "1:2", {}};
        StudyRun run(sunk, m);
        const std::size_t box = body_index(sunk, "box");
        while (run.time() < 3) {
            run.step();
            const Real height = run.states()[box].position.z() - 0.5;
            curve.points.push_back({run.time(), height});
            speed = std::max(speed, run.states()[box].linear_velocity.z());
            highest = std::max(highest, height);
            if (recovered < 0 && std::abs(height) < 1e-3) recovered = run.time();
        }
        f.curves.push_back(curve);
        t.row({name, recovered < 0 ? "never" : fmt::format("{:.2f}", recovered), number(speed), number(highest)});
        if (how == Stabilisation::kTargetVelocity) pop = speed;
    }
    s.conclude(
        fmt::format("Without stabilisation the stack of five {}, with the target velocity it {}; the price is that the sunk box comes "
                    "out at up to {} m/s.",
                    without, with_target, number(pop)));
}

void study_shifted_stack(StudyReport& s, bool quick) {
    s.say(
        "Each box is shifted by 0.15 m against the one below, so the contact points of a pair do not share the load evenly: the points on "
        "the "
        "side to which the stack leans carry more. Sweeps find such a distribution by giving and taking. The per-iteration clamp only "
        "gives: what the first sweeps gave to the points of the light side stays, its torque stays, and there is a spin left that no "
        "number "
        "of sweeps removes (second figure). Without friction, as in this part of the sheet, the upper boxes then walk off. Friction hides "
        "it as long as the lean is small (last rows: 0.19 m of shift). With few sweeps from zero impulses both clamps fall: the step is "
        "not "
        "solved.");
    const Scene scene = sheet_scene("sheet_shifted_stack"), lean = box_stack(5, 0.19);
    const Real duration = quick ? 8 : 60;
    StudyTable& t = s.table("1f_shifted",
                            fmt::format("Five boxes, each shifted against the one below, impulses from zero in each step; {} s.", duration),
                            kStandingColumns);
    StudyFigure& poses =
        s.figure("1f_stack",
                 "The shifted stack without friction after 3 s (or when a box is 0.5 m off), 1000 sweeps: per-iteration clamp "
                 "on the left, accumulated on the right.",
                 "set size ratio -1\nset xlabel 'x [m]'\nset ylabel 'z [m]'\nset key outside");
    std::string results[2];
    Real drifts[2] = {0, 0};
    struct Case {
        int sweeps;
        bool friction;
    };
    for (const Case& c : {Case{10, false}, Case{200, false}, Case{1000, false}, Case{200, true}}) {
        for (const Clamp clamp : {Clamp::kPerIteration, Clamp::kAccumulated}) {
            const bool each = clamp == Clamp::kPerIteration;
            const std::string name = fmt::format("{} clamp, {} sweeps{}", each ? "per-iteration" : "accumulated", c.sweeps,
                                                 c.friction ? ", friction, shift 0.19 m" : "");
            const StudyModel m = with(c.friction ? textbook(name, c.sweeps) : frictionless(name, c.sweeps), clamp);
            std::vector<BodyState> seen;
            const Standing r = stand(c.friction ? lean : scene, m, duration, 0.5, [&](StudyRun& run) {
                if (run.time() < 3.001) seen = run.states();
            });
            const std::vector<std::string> row = standing_row(m, r);
            t.row(row);
            if (c.sweeps != 1000) continue;
            results[each ? 0 : 1] = row[1];
            drifts[each ? 0 : 1] = r.drift;
            poses.curves.push_back(outlines(each ? "per-iteration clamp" : "accumulated clamp", scene, seen, each ? 0 : 3.5));
        }
    }
    StudyModel m = default_auto();
    m.name += ", friction";
    t.row(standing_row(m, stand(scene, m, duration, 0.5)));
    StudyFigure& f = s.figure("1f_spin", "Largest angular velocity after one step, over the number of sweeps.",
                              "set xlabel 'sweeps'\nset ylabel 'ω [rad/s]'\nset logscale xy\nset format y '10^{%L}'\nset key left bottom");
    Real stuck = 0, left = 0;
    for (const Clamp clamp : {Clamp::kPerIteration, Clamp::kAccumulated}) {
        StudyCurve curve{clamp == Clamp::kPerIteration ? "per-iteration clamp" : "accumulated clamp", "linespoints lw 2", "1:2", {}};
        for (int sweeps = 1; sweeps <= 1024; sweeps *= 2) {
            const Real spin = spin_left(scene, with(frictionless(""), clamp), sweeps);
            curve.points.push_back({static_cast<Real>(sweeps), std::max(spin, 1e-16)});
            (clamp == Clamp::kPerIteration ? stuck : left) = spin;
        }
        f.curves.push_back(curve);
    }
    s.conclude(fmt::format(
        "With 1000 sweeps and without friction the shifted stack {} with the per-iteration clamp and {} with the accumulated one "
        "(drift {} m in {} s); after 1024 sweeps of one step the first still leaves {} rad/s, the second {} rad/s.",
        results[0], results[1], number(drifts[1]), duration, number(stuck), number(left)));
}

}  // namespace cairn::cli
