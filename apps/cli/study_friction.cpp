// 2b, 2c, 2d: friction along one direction, and along two.
#include "apps/cli/study.hpp"
#include "apps/cli/study_run.hpp"
#include "apps/cli/study_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::cli {

namespace {

struct NamedFriction {
    const char* name;
    FrictionModel model;
};
constexpr NamedFriction kFrictions[] = {{"one direction", FrictionModel::kOneDirection},
                                        {"pyramid, fixed tangents", FrictionModel::kPyramidFixed},
                                        {"pyramid along the slip", FrictionModel::kPyramid},
                                        {"cone", FrictionModel::kCone}};

// The default substep, friction apart: so that one thing alone differs.
StudyModel friction_model(const NamedFriction& friction) {
    StudyModel m = default_si();
    m.name = friction.name;
    m.settings.model.friction = friction.model;
    return m;
}

struct Stop {
    Real distance_error = 0;  // relative to v²/(2 μ g)
    Real bend = 0;            // [rad], of the way against the launch
};

Stop stop_of(const Scene& base, const StudyModel& model, Real angle) {
    const Scene scene = launched(base, angle);
    const std::size_t box = body_index(scene, "box");
    const BodyDef& b = scene.bodies[box];
    StudyRun run(scene, model);
    while (run.time() < scene.duration) run.step();
    Vec3 way = run.states()[box].position - b.position;
    way.z() = 0;
    const Real mu = std::sqrt(b.friction * scene.bodies[body_index(scene, "ground")].friction);
    const Real truth = b.linear_velocity.squaredNorm() / (2 * mu * scene.gravity.norm());
    return {way.norm() / truth - 1, std::atan2(b.linear_velocity.cross(way).norm(), b.linear_velocity.dot(way))};
}

// Where a box on a slope goes, and what t₁ does meanwhile.
struct Creep {
    Real down = 0, across = 0;  // [m], at the end
    Real turn = 0;              // [rad], mean change of t₁'s direction from step to step
    Real off = 0;               // [rad], mean angle between t₁ and the slope's direction
    StudyCurve way{"", "lines lw 2", "1:2", {}};
    StudyCurve direction{"", "points pt 7 ps 0.4", "1:2", {}};
};

Creep creep_of(const Scene& scene, const StudyModel& model, Real duration) {
    Creep c;
    c.way.title = c.direction.title = model.name;
    const std::size_t box = body_index(scene, "box");
    const Vec3 n = scene.bodies[body_index(scene, "ground")].shapes.front().normal;
    const Vec3 down = (scene.gravity - n * n.dot(scene.gravity)).normalized(), across = n.cross(down);
    StudyRun run(scene, model);
    Vec3 last = Vec3::Zero();
    int samples = 0;
    while (run.time() < duration - 1e-9) {
        run.step();
        const Vec3 way = run.states()[box].position - scene.bodies[box].position;
        c.down = way.dot(down);
        c.across = way.dot(across);
        c.way.points.push_back({run.time(), 1000 * way.norm()});
        if (run.world() == nullptr || run.world()->manifolds().empty()) continue;
        const Vec3 t1 = run.world()->manifolds().front().points[0].t1;
        // A direction of friction has no sign.
        const auto angle = [](const Vec3& a, const Vec3& b) { return std::acos(std::min(std::abs(a.dot(b)), 1.0)); };
        if (last != Vec3::Zero()) c.turn += angle(t1, last);
        c.off += angle(t1, down);
        const Real theta = 180 / kPi * std::atan2(t1.dot(across), t1.dot(down));
        if (run.time() < 2) c.direction.points.push_back({run.time(), theta > 90 ? theta - 180 : theta < -90 ? theta + 180 : theta});
        last = t1;
        ++samples;
    }
    if (samples > 1) c.turn /= samples - 1, c.off /= samples;
    return c;
}

std::string degrees(Real radians) {
    return fmt::format("{:.1f}", 180 / kPi * radians);
}

// The friction impulses of all points of a run, as shares of μ λ_N, in a frame that stays.
StudyCurve scatter(const Scene& scene, const NamedFriction& friction, Real duration, Real& largest) {
    StudyModel m = textbook_warm(friction.name);
    m.settings.model.friction = friction.model;
    StudyCurve curve{friction.name, "points pt 7 ps 0.5", "1:2", {}};
    StudyRun run(scene, m);
    largest = 0;
    while (run.time() < duration) {
        run.step();
        for (const ManifoldView& manifold : run.world()->manifolds()) {
            const Vec3 e1 = any_perpendicular(manifold.n), e2 = manifold.n.cross(e1);
            for (int k = 0; k < manifold.count; ++k) {
                const ContactPointView& p = manifold.points[k];
                const Real bound = manifold.friction * p.normal_impulse;
                if (bound < 1e-6) continue;
                const Vec3 f = p.friction_impulse[0] * p.t1 + p.friction_impulse[1] * p.t2;
                curve.points.push_back({f.dot(e1) / bound, f.dot(e2) / bound});
                largest = std::max(largest, f.norm() / bound);
            }
        }
    }
    // A few thousand dots show the same as all.
    const std::size_t every = curve.points.size() / 3000 + 1;
    std::vector<std::vector<Real>> some;
    for (std::size_t k = 0; k < curve.points.size(); k += every) some.push_back(curve.points[k]);
    curve.points = some;
    return curve;
}

}  // namespace

void study_one_direction(StudyReport& s, bool quick) {
    s.say(
        "t₁ = v_T/‖v_T‖ from the slip velocity v_T = v − n nᵀv of the point at the start of the step; where v_T = 0 exactly, any fixed "
        "perpendicular of n takes its place. S₁ = G₁M⁻¹G₁ᵀ and M⁻¹G₁ᵀα₁ are those of a normal row with t₁ for n (study 1c checks "
        "them). In each sweep the normal impulses come first, and α₁ is then clamped to ±μ λ_N with the λ_N of that moment. All runs "
        "here are of the default substep with this friction, so that friction alone differs.");
    const StudyModel one = friction_model(kFrictions[0]);
    const Scene slide = sheet_scene("sheet_slide");
    StudyTable& t = s.table("2b_motion", "Friction along one direction.", {"scene", "result", "truth", "error"});
    Real worst = 0;
    for (const Real degree : {0.0, 22.5, 45.0}) {
        const Stop stop = stop_of(slide, one, degree * kPi / 180);
        worst = std::max(worst, std::abs(stop.distance_error));
        t.row({fmt::format("sliding box, launched at {}°", degree), fmt::format("bends by {}°", degrees(stop.bend)),
               "stops after v²/(2 μ g)", fmt::format("{:+.2g} %", 100 * stop.distance_error)});
    }
    const Scene roll = sheet_scene("sheet_roll");
    StudyRun run(roll, one);
    while (run.time() < roll.duration) run.step();
    const std::size_t ball = body_index(roll, "ball");
    const Real v = run.states()[ball].linear_velocity.x(), truth = 5.0 / 7 * roll.bodies[ball].linear_velocity.x();
    t.row({"ball: speed when it rolls", number(v) + " m/s", number(truth) + " m/s", fmt::format("{:+.2g} %", 100 * (v / truth - 1))});
    const Real duration = quick ? 5 : 20;
    const Standing stack = stand(sheet_scene("sheet_stack"), one, duration, 0.5);
    t.row({fmt::format("stack of five, {} s", duration), standing_row(one, stack)[1], "stands",
           stack.stands() ? number(stack.drift) + " m" : "–"});
    s.conclude(fmt::format(
        "What slides and rolls is right: stop distances within {:.2g} %, the rolling speed within {:.2g} %; the stack of five drifts "
        "{} m in {} s.",
        100 * worst, 100 * std::abs(v / truth - 1), number(stack.drift), duration));
}

void study_static_friction(StudyReport& s, bool quick) {
    const Scene slope = sheet_scene("sheet_slope");
    const Real duration = quick ? 8 : slope.duration;
    s.say(
        "At rest v_T is what the last solve left, rounding and unfinished sweeps, and its direction is noise. The one row of the step then "
        "points "
        "anywhere: gravity's part across t₁ meets no friction in that step, and even along t₁ the bound must be reached with a row that is "
        "not "
        "the one of the step before. What slips across it makes the next t₁. The table has the direction's mean change from step to step "
        "and "
        "its mean angle to the slope's own direction, the only one that friction is needed in.");
    StudyTable& t =
        s.table("2c_creep", fmt::format("A box on a slope of 0.95 of its friction angle, {} s: Coulomb's law holds it.", duration),
                {"friction", "creep down [mm]", "creep across [mm]", "t₁ turns per step [°]", "t₁ off the slope [°]"});
    StudyFigure& f = s.figure("2c_creep", "Distance of the box from its start.",
                              "set xlabel 't [s]'\nset ylabel 'creep [mm]'\nset logscale y\nset yrange [1e-3:1e4]\nset format y "
                              "'10^{%L}'\nset key left top Left reverse maxrows 2");
    StudyFigure& g = s.figure("2c_direction", "Direction of t₁ of one contact point against the slope's direction.",
                              "set xlabel 't [s]'\nset ylabel 'angle [°]'\nset yrange [-90:90]\nset ytics 30");
    Real one = 0, pyramid = 0, turn = 0;
    const auto add = [&](const StudyModel& m) {
        const Creep c = creep_of(slope, m, duration);
        const bool seen = m.engine.empty();
        t.row({m.name, number(1000 * c.down), number(1000 * c.across), seen ? degrees(c.turn) : "–", seen ? degrees(c.off) : "–"});
        f.curves.push_back(c.way);
        for (std::vector<Real>& p : f.curves.back().points) p[1] = std::max(p[1], 1e-3);
        return c;
    };
    for (const NamedFriction& friction : kFrictions) {
        const Creep c = add(friction_model(friction));
        const Real way = std::hypot(c.down, c.across);
        if (friction.model == FrictionModel::kOneDirection) one = way, turn = c.turn;
        if (friction.model == FrictionModel::kPyramid) pyramid = way;
        if (friction.model == FrictionModel::kOneDirection || friction.model == FrictionModel::kPyramid) g.curves.push_back(c.direction);
    }
    StudyModel plain = textbook_warm("one direction, textbook's substep");
    plain.settings.model.friction = FrictionModel::kOneDirection;
    add(plain);
    if (is_available(bullet())) {
        add(bullet());
    } else {
        t.row({"Bullet", "not in this build", "–", "–", "–"});
    }
    s.conclude(fmt::format(
        "With one direction the box creeps {} mm in {} s while t₁ turns by {}° from step to step; with the pyramid along the slip "
        "it moves {} mm ({}).",
        number(1000 * one), duration, degrees(turn), number(1000 * pyramid), pyramid < 1e-3 ? "under 1 mm" : "NOT under 1 mm"));
}

void study_pyramid(StudyReport& s, bool quick) {
    s.say(
        "Two rows a point, t₁ and t₂ = n × t₁, each clamped to ±μ λ_N on its own: friction acts in every direction, also at rest. The "
        "pyramid "
        "allows √2 μ λ_N along its diagonal: with fixed tangents a box that slides at 45° to them stops short. With t₁ along the slip the "
        "diagonal is never the direction of sliding. The cone bounds ‖α‖ itself.");
    const Scene slide = sheet_scene("sheet_slide");
    StudyTable& t = s.table("2d_stop", "Stop distance of a box launched at an angle to the fixed tangents, error against v²/(2 μ g).",
                            {"friction", "0°", "22.5°", "45°", "worst over all angles", "largest bend of the way [°]"});
    StudyFigure& f = s.figure("2d_stop", "Error of the stop distance over the launch direction.",
                              "set xlabel 'launch direction [°]'\nset ylabel 'error [%]'\nset xtics 15\nset key left bottom");
    const Real step = quick ? 22.5 : 7.5;
    Real fixed = 0, aligned = 0;
    std::vector<StudyModel> models;
    for (const NamedFriction& friction : kFrictions) models.push_back(friction_model(friction));
    models.push_back(bullet());
    for (const StudyModel& m : models) {
        if (!is_available(m)) {
            t.row({m.name, "not in this build", "–", "–", "–", "–"});
            continue;
        }
        StudyCurve curve{m.name, "linespoints lw 2", "1:2", {}};
        Real worst = 0, bend = 0;
        for (Real angle = 0; angle <= 90; angle += step) {
            const Stop stop = stop_of(slide, m, angle * kPi / 180);
            curve.points.push_back({angle, 100 * stop.distance_error});
            worst = std::max(worst, std::abs(stop.distance_error));
            bend = std::max(bend, stop.bend);
        }
        const auto at = [&](Real angle) {
            return fmt::format("{:+.2g} %", curve.points[static_cast<std::size_t>(std::lround(angle / step))][1]);
        };
        t.row({m.name, at(0), at(22.5), at(45), fmt::format("{:.2g} %", 100 * worst), degrees(bend)});
        f.curves.push_back(curve);
        if (m.settings.model.friction == FrictionModel::kPyramidFixed) fixed = worst;
        if (m.settings.model.friction == FrictionModel::kPyramid && m.engine.empty()) aligned = worst;
    }
    const Scene thrown = sheet_scene("sheet_throw");
    StudyTable& throws =
        s.table("2d_throw", "A ball of 3 kg is thrown at five boxes at rest (12 m/s); after 3 s.",
                {"friction", "boxes that left their place", "farthest box [m]", "ball at x [m]", "moved before the hit [m]"});
    for (const StudyModel& m : models) {
        if (!is_available(m)) continue;
        StudyRun run(thrown, m);
        int moved = 0;
        Real farthest = 0, before = 0;
        while (run.time() < thrown.duration) {
            run.step();
            moved = 0;
            farthest = 0;
            for (int k = 0; k < 5; ++k) {
                const std::size_t i = body_index(thrown, "box" + std::to_string(k));
                const Real way = (run.states()[i].position - thrown.bodies[i].position).norm();
                moved += way > 0.25;
                farthest = std::max(farthest, way);
            }
            if (run.time() < 0.3) before = std::max(before, farthest);
        }
        throws.row({m.name, std::to_string(moved), number(farthest), number(run.states()[body_index(thrown, "ball")].position.x()),
                    number(before)});
    }
    StudyFigure& dots =
        s.figure("2d_scatter",
                 "Friction impulses of every point while the ball hits the stack, as shares of μ λ_N, along tangents "
                 "that stay: the fixed pyramid is a square, the cone a disc, the pyramid along the slip a square that turns.",
                 "set size ratio -1\nset xlabel 'α_1 / (μ λ_N)'\nset ylabel 'α_2 / (μ λ_N)'\nset xrange [-1.5:1.5]\nset yrange "
                 "[-1.5:1.5]\nset key outside\n"
                 "set object 1 circle at 0,0 size 1 behind fillstyle empty border lc rgb 'gray'\nset object 2 rectangle from -1,-1 to 1,1 "
                 "behind fillstyle empty border lc rgb 'gray'");
    Real corner = 0, disc = 0;
    dots.curves.push_back(scatter(thrown, kFrictions[1], thrown.duration, corner));
    dots.curves.push_back(scatter(thrown, kFrictions[3], thrown.duration, disc));
    s.conclude(fmt::format(
        "With fixed tangents the stop distance is up to {:.3g} % off, with the pyramid along the slip {:.2g} % ({}). The largest friction "
        "is {} μ λ_N in the fixed pyramid and {} μ λ_N in the cone.",
        100 * fixed, 100 * aligned, aligned < 0.005 ? "under 0.5 %" : "NOT under 0.5 %", number(corner), number(disc)));
}

}  // namespace cairn::cli
