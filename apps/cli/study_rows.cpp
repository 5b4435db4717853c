// 1a, 1b, 1c, 2a: the constraints and their rows.
#include "apps/cli/random.hpp"
#include "apps/cli/study.hpp"
#include "apps/cli/study_run.hpp"
#include "apps/cli/study_scenes.hpp"
#include "solver/contact_rows.hpp"
#include "solver/joint_rows.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::cli {

namespace {

using Vec12 = Eigen::Matrix<Real, 12, 1>;
using Mat12 = Eigen::Matrix<Real, 12, 12>;
constexpr Real kDifference = 1e-5;

Vec3 random_vector(Random& r, Real size = 1) {
    const Real x = r.uniform(-size, size), y = r.uniform(-size, size), z = r.uniform(-size, size);
    return {x, y, z};
}

BodyMotion random_body(Random& r) {
    BodyMotion m;
    const Real mass = r.uniform(0.5, 5);
    const Vec3 edges(r.uniform(0.6, 1.0), r.uniform(1.1, 1.5), r.uniform(1.6, 2.0));
    const Vec3 squares = edges.cwiseAbs2();
    const Vec3 moments = mass / 12 * (Vec3::Constant(squares.sum()) - squares);
    m.inv_mass = 1 / mass;
    m.x = random_vector(r);
    m.q = r.rotation();
    m.R = m.q.toRotationMatrix();
    m.inv_inertia_B = moments.cwiseInverse().asDiagonal();
    m.inv_inertia_W = m.R * m.inv_inertia_B * m.R.transpose();
    m.moves = true;
    return m;
}

JointPose moved(const BodyMotion& m, const Vec3& v, const Vec3& w, Real e) {
    return {m.x + e * v, exp_rotation(e * w).toRotationMatrix() * m.R};
}

Mat12 dense_inverse_mass(const BodyMotion& a, const BodyMotion& b) {
    Mat12 M = Mat12::Zero();
    int at = 0;
    for (const BodyMotion* m : {&a, &b}) {
        M.block<3, 3>(at, at) = m->inv_mass * Mat3::Identity();
        const Mat3 inertia = m->R * m->inv_inertia_B.diagonal().cwiseInverse().asDiagonal() * m->R.transpose();
        M.block<3, 3>(at + 3, at + 3) = inertia.inverse();
        at += 6;
    }
    return M;
}

// Largest errors over the poses: of G against central differences, of M⁻¹Gᵀ and S against the dense product; relative.
struct RowErrors {
    Real G = 0, W = 0, S = 0;
};

template <typename Function>
Real difference_error(const BodyMotion& a, const BodyMotion& b, const Vec12& G, Function C) {
    Real worst = 0;
    for (int k = 0; k < 12; ++k) {
        const Vec12 u = Vec12::Unit(k);
        const auto at = [&](Real e) {
            return C(moved(a, u.segment<3>(0), u.segment<3>(3), e), moved(b, u.segment<3>(6), u.segment<3>(9), e));
        };
        worst = std::max(worst, std::abs((at(kDifference) - at(-kDifference)) / (2 * kDifference) - G[k]) / G.norm());
    }
    return worst;
}

// The distance of two material points along a direction that stands still: the contact (n) and the friction row (t).
RowErrors point_row_errors(int poses, Random& r) {
    RowErrors worst;
    for (int i = 0; i < poses; ++i) {
        const BodyMotion a = random_body(r), b = random_body(r);
        const Vec3 n = r.direction(), at_a = random_vector(r), at_b = random_vector(r);
        const PointRow row = make_point_row(n, a.R * at_a, b.R * at_b, a, b);
        Vec12 G, W;
        G << n, row.ang_a, -n, -row.ang_b;
        W << a.inv_mass * n, row.iang_a, -b.inv_mass * n, -row.iang_b;
        const Vec12 dense = dense_inverse_mass(a, b) * G;
        worst.G = std::max(worst.G, difference_error(a, b, G, [&](const JointPose& pa, const JointPose& pb) {
                               return n.dot(pa.x + pa.R * at_a - pb.x - pb.R * at_b);
                           }));
        worst.W = std::max(worst.W, (W - dense).norm() / dense.norm());
        worst.S = std::max(worst.S, std::abs(row.mass * G.dot(dense) - 1));
    }
    return worst;
}

template <JointKind K>
RowErrors joint_row_errors(int poses, Random& r) {
    constexpr int N = joint_rows(K);
    RowErrors worst;
    for (int i = 0; i < poses; ++i) {
        const BodyMotion a = random_body(r), b = random_body(r);
        JointGeometry g;
        g.anchor_a_A = random_vector(r);
        g.frame_A = r.rotation().toRotationMatrix();
        const Vec3 apart = K == JointKind::kDistance ? Vec3(r.direction()) : Vec3(random_vector(r, 0.1));
        g.anchor_b_B = b.R.transpose() * (a.x + a.R * g.anchor_a_A - apart - b.x);
        g.frame_B = b.R.transpose() * exp_rotation(random_vector(r, 0.1)).toRotationMatrix() * a.R * g.frame_A;
        g.length = apart.norm();
        Jacobian<N> G_a, G_b;
        const JointPose pose_a{a.x, a.R}, pose_b{b.x, b.R};
        joint_jacobian<K>(g, pose_a, pose_b, G_a, G_b);
        for (int row = 0; row < N; ++row) {
            Vec12 G;
            G << G_a.row(row).transpose(), G_b.row(row).transpose();
            worst.G = std::max(worst.G, difference_error(a, b, G, [&](const JointPose& pa, const JointPose& pb) {
                                   return joint_error<K>(g, pa, pb)[row];
                               }));
        }
        // What build_joints() makes of it.
        SolverBodies bodies;
        bodies.motion = {a, b};
        bodies.velocity.resize(2);
        JointPool pool;
        JointRanges ranges;
        JointBlock<N>* block = nullptr;
        if constexpr (K == JointKind::kBall) block = &pool.ball.emplace_back();
        if constexpr (K == JointKind::kHinge) block = &pool.hinge.emplace_back();
        if constexpr (K == JointKind::kSlider) block = &pool.slider.emplace_back();
        if constexpr (K == JointKind::kFixed) block = &pool.fixed.emplace_back();
        if constexpr (K == JointKind::kDistance) block = &pool.distance.emplace_back();
        ranges.end[static_cast<int>(K)] = 1;
        block->a = 0;
        block->b = 1;
        block->geometry = g;
        build_joints(pool, ranges, bodies);
        Eigen::Matrix<Real, N, 12> G;
        G << G_a, G_b;
        const Eigen::Matrix<Real, 12, N> dense = dense_inverse_mass(a, b) * G.transpose();
        Eigen::Matrix<Real, 12, N> W;
        W << block->W_a, block->W_b;
        const Eigen::Matrix<Real, N, N> S = G * dense;
        worst.W = std::max(worst.W, (W - dense).norm() / dense.norm());
        worst.S = std::max(worst.S, (block->G_a * block->W_a + block->G_b * block->W_b - S).norm() / S.norm());
    }
    return worst;
}

void pushed_box(StudyReport& s, const char* name, Real force, const Scene& base, Real& way, Real& truth, Real& impulse) {
    Scene scene = base;
    BodyDef& box = scene.bodies[body_index(scene, "box")];
    box.force = Vec3(force, 0, 0);
    StudyModel model = textbook("textbook");
    StudyRun run(scene, model);
    for (int k = 0; k < 60; ++k) run.step();
    const BodyState& state = run.states()[body_index(scene, "box")];
    impulse = 0;
    Real gap = 0;
    for (const ManifoldView& m : run.world()->manifolds()) {
        for (int k = 0; k < m.count; ++k) {
            impulse += m.points[k].normal_impulse;
            gap = std::max(gap, std::abs(m.points[k].separation));
        }
    }
    way = state.position.x() - box.position.x();
    // The textbook moves by the velocity at the end of each step: h²a (1 + 2 + … + 60).
    truth = force / box.mass * model.dt * model.dt * 60 * 61 / 2;
    s.tables.back().row(
        {name, number(force), number(gap), number(impulse), number(box.mass * 9.81 * model.dt), number(way), number(truth)});
}

StudyCurve box_outline(const std::string& title, const BodyState& state) {
    StudyCurve outline{title, "lines lw 2", "1:2", {}};
    for (const auto& corner : {Vec3(0.5, 0, 0.5), Vec3(-0.5, 0, 0.5), Vec3(-0.5, 0, -0.5), Vec3(0.5, 0, -0.5), Vec3(0.5, 0, 0.5)}) {
        const Vec3 p = state.position + state.rotation * corner;
        outline.points.push_back({p.x(), p.z()});
    }
    return outline;
}

// From `p` along `v`, in the x, z plane.
std::vector<Real> arrow(const Vec3& p, const Vec3& v) {
    return {p.x(), p.z(), v.x(), v.z()};
}

// A tilted box that is about to land on another: the sheet's figure, from the manifold.
void draw_contact(StudyReport& s) {
    Scene scene = box_stack(2);
    BodyDef& upper = scene.bodies[body_index(scene, "box1")];
    upper.rotation = exp_rotation(Vec3(0, 0.35, 0));
    upper.position += Vec3(0.1, 0, 0.2);
    StudyRun run(scene, textbook("textbook"));
    const World& world = *run.world();
    const auto is_pair = [&](const ManifoldView& m) {
        return world.type(m.body_a) == BodyType::kDynamic && world.type(m.body_b) == BodyType::kDynamic;
    };
    std::vector<ManifoldView> manifolds;
    do {
        run.step();
        manifolds = world.manifolds();
    } while (std::none_of(manifolds.begin(), manifolds.end(), is_pair) && run.time() < 1);
    StudyFigure& f =
        s.figure("1a_contact",
                 "The contact of the sheet's figure, from the manifold of a tilted box A that lands on B: the arms from the centres of "
                 "mass to the surface points r₁ and r₂, n from B to A, and the gap C_N between the points.",
                 "set size ratio -1\nset xlabel 'x [m]'\nset ylabel 'z [m]'\nset xrange [-1.2:1.6]\nset yrange [-0.1:2.5]");
    const BodyState &a = run.states()[body_index(scene, "box1")], &b = run.states()[body_index(scene, "box0")];
    StudyCurve to_r1{"to r_1", "vectors head filled lw 1.5", "1:2:3:4", {}}, to_r2{"to r_2", "vectors head filled lw 1.5", "1:2:3:4", {}},
        normal{"n", "vectors head filled lw 2", "1:2:3:4", {}}, gap{"gap C_N", "vectors nohead lw 2", "1:2:3:4", {}};
    for (const ManifoldView& m : manifolds) {
        if (!is_pair(m)) continue;
        const bool is_a = world.name(m.body_a) == "box1";
        for (int k = 0; k < m.count; ++k) {
            const ContactPointView& p = m.points[k];
            const Vec3 r1 = is_a ? p.position_a : p.position_b, r2 = is_a ? p.position_b : p.position_a;
            to_r1.points.push_back(arrow(a.position, r1 - a.position));
            to_r2.points.push_back(arrow(b.position, r2 - b.position));
            normal.points.push_back(arrow(r2, (is_a ? 0.3 : -0.3) * m.n));
            gap.points.push_back(arrow(r2, r1 - r2));
        }
    }
    f.curves = {box_outline("A", a), box_outline("B", b), to_r1, to_r2, normal, gap};
}

}  // namespace

void study_constraint(StudyReport& s, bool) {
    const Scene scene = sheet_scene("sheet_push");
    s.say(
        "Two surface points r₁ on body A and r₂ on body B, and the unit normal n that points from B to A: C_N = nᵀ(r₁ − r₂) is the gap "
        "along "
        "n. C_N > 0: apart; C_N = 0: they touch; C_N < 0: A is inside B. Keeping C_N ≥ 0 keeps A on its side of B's tangent plane, which "
        "near the contact is B's surface. C_N does not change when A moves across n (nᵀt = 0), so no force along the surface is answered.");
    s.table("1a_push", "A box of 2 kg on a surface without friction, pushed along it for 1 s.",
            {"run", "force [N]", "largest gap [m]", "Σ λ_N of a step [N s]", "m g h [N s]", "way [m]", "F/m h² Σk [m]"});
    Real way, truth, rest, pushed;
    pushed_box(s, "at rest", 0, scene, way, truth, rest);
    pushed_box(s, "pushed", 5, scene, way, truth, pushed);
    draw_contact(s);
    s.conclude(
        fmt::format("The force of 5 N changes the sum of the normal impulses by {} N s and moves the box by {} m, which is what F/m "
                    "alone does within {} m: the constraint answers along n and nowhere else.",
                    number(std::abs(pushed - rest)), number(way), number(std::abs(way - truth))));
}

void study_velocity_map(StudyReport& s, bool) {
    s.say(
        "The ball joint's C_B = r₁ − r₂ has Ċ_B = G_B v with G_B = [1, −[r_A]×, −1, [r_B]×], r_A and r_B the arms from the centres of "
        "mass. "
        "With C_N = nᵀ C_B and Ċ_N = nᵀ Ċ_B + ṅᵀ C_B the map of the contact is G_N = nᵀ G_B = [nᵀ, (r_A × n)ᵀ, −nᵀ, −(r_B × n)ᵀ] as long "
        "as "
        "n stands still or r₁ and r₂ lie on one normal (then ṅᵀ C_B = C_N ṅᵀ n = 0). `make_point_row` holds it; `joint_jacobian` is G_B.");
    Random r(11);
    Real worst = 0, difference = 0;
    constexpr int kPoses = 1000;
    for (int i = 0; i < kPoses; ++i) {
        const BodyMotion a = random_body(r), b = random_body(r);
        const Vec3 n = r.direction();
        JointGeometry g;
        g.anchor_a_A = random_vector(r);
        g.anchor_b_B = random_vector(r);
        Jacobian<3> G_a, G_b;
        joint_jacobian<JointKind::kBall>(g, {a.x, a.R}, {b.x, b.R}, G_a, G_b);
        const PointRow row = make_point_row(n, a.R * g.anchor_a_A, b.R * g.anchor_b_B, a, b);
        Vec12 G_N, from_ball;
        G_N << n, row.ang_a, -n, -row.ang_b;
        from_ball << G_a.transpose() * n, G_b.transpose() * n;
        worst = std::max(worst, (G_N - from_ball).norm());
        difference = std::max(difference, difference_error(a, b, G_N, [&](const JointPose& pa, const JointPose& pb) {
                                  return n.dot(pa.x + pa.R * g.anchor_a_A - pb.x - pb.R * g.anchor_b_B);
                              }));
    }
    StudyTable& t =
        s.table("1b_map", fmt::format("Over {} random pairs of bodies and points.", kPoses), {"comparison", "largest error", "bound"});
    t.row({"‖G_N − nᵀG_B‖", number(worst), "1e-12"});
    t.row({"G_N against central differences of C_N, relative", number(difference), "1e-7"});
    s.conclude(fmt::format("G_N is nᵀG_B to {} and the derivative of C_N to {} of its length: both within their bounds: {}.", number(worst),
                           number(difference), worst < 1e-12 && difference < 1e-7 ? "yes" : "NO"));
}

void study_masses(StudyReport& s, bool) {
    s.say(
        "M is block diagonal, so M⁻¹G_Nᵀ λ = λ [n/m_A, I_A⁻¹(r_A × n), −n/m_B, −I_B⁻¹(r_B × n)]: an impulse λ n at r₁ on A and the "
        "opposite "
        "one at r₂ on B. From this S = G M⁻¹Gᵀ = 1/m_A + 1/m_B + (r_A × n)ᵀI_A⁻¹(r_A × n) + (r_B × n)ᵀI_B⁻¹(r_B × n), a scalar > 0: how "
        "much "
        "normal velocity one unit of impulse makes. The same for t in place of n; a joint's S is a matrix of its rows.");
    Random r(12);
    constexpr int kPoses = 1000;
    StudyTable& t = s.table("1c_rows", fmt::format("Largest relative errors over {} random poses per row type.", kPoses),
                            {"rows", "G against central differences", "M⁻¹Gᵀ against dense algebra", "S against dense algebra"});
    RowErrors worst;
    const auto add = [&](const char* name, const RowErrors& e) {
        t.row({name, number(e.G), number(e.W), number(e.S)});
        worst = {std::max(worst.G, e.G), std::max(worst.W, e.W), std::max(worst.S, e.S)};
    };
    add("contact, friction (`make_point_row`)", point_row_errors(kPoses, r));
    add("ball joint", joint_row_errors<JointKind::kBall>(kPoses, r));
    add("hinge", joint_row_errors<JointKind::kHinge>(kPoses, r));
    add("slider", joint_row_errors<JointKind::kSlider>(kPoses, r));
    add("fixed joint", joint_row_errors<JointKind::kFixed>(kPoses, r));
    add("distance joint", joint_row_errors<JointKind::kDistance>(kPoses, r));
    s.conclude(
        fmt::format("Every G is within {} of central differences (bound 1e-7), every M⁻¹Gᵀ and S within {} of dense algebra (bound "
                    "1e-12): {}.",
                    number(worst.G), number(std::max(worst.W, worst.S)),
                    worst.G < 1e-7 && std::max(worst.W, worst.S) < 1e-12 ? "all hold" : "NOT all hold"));
}

void study_friction_force(StudyReport& s, bool) {
    s.say(
        "G_T has rows like G_N with t₁ and t₂ for n. G_Tᵀ λ_T is then a force f = α₁ t₁ + α₂ t₂ on A and −f on B, with the torques r_A × f "
        "and "
        "−r_B × f about the centres of mass: the moment of the force at the contact, since α (r × t) = r × (α t).");
    Random r(21);
    constexpr int kPoses = 1000;
    Real force = 0, torque = 0;
    for (int i = 0; i < kPoses; ++i) {
        const BodyMotion a = random_body(r), b = random_body(r);
        const Vec3 n = r.direction(), t1 = any_perpendicular(n), t2 = n.cross(t1), r_a = random_vector(r), r_b = random_vector(r);
        const Real alpha1 = r.uniform(-5, 5), alpha2 = r.uniform(-5, 5);
        const PointRow row1 = make_point_row(t1, r_a, r_b, a, b), row2 = make_point_row(t2, r_a, r_b, a, b);
        const Vec3 f = alpha1 * t1 + alpha2 * t2;
        Vec12 from_rows, direct;
        from_rows << alpha1 * t1 + alpha2 * t2, alpha1 * row1.ang_a + alpha2 * row2.ang_a, -alpha1 * t1 - alpha2 * t2,
            -alpha1 * row1.ang_b - alpha2 * row2.ang_b;
        direct << f, r_a.cross(f), -f, -r_b.cross(f);
        force = std::max({force, (from_rows - direct).segment<3>(0).norm(), (from_rows - direct).segment<3>(6).norm()});
        torque = std::max({torque, (from_rows - direct).segment<3>(3).norm(), (from_rows - direct).segment<3>(9).norm()});
    }
    StudyTable& t =
        s.table("2a_force", fmt::format("G_Tᵀ λ_T against the direct computation, {} random contacts, forces up to 7 N.", kPoses),
                {"part", "largest error"});
    t.row({"force [N]", number(force)});
    t.row({"torque [N m]", number(torque)});
    s.conclude(fmt::format("Forces agree to {} N and torques to {} N m: rounding.", number(force), number(torque)));
}

}  // namespace cairn::cli
