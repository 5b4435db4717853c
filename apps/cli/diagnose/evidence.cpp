#include "apps/cli/diagnose/evidence.hpp"

#include "apps/cli/diagnose/limits.hpp"
#include "apps/cli/step_report_file.hpp"
#include "apps/cli/truth_parts.hpp"
#include "collision/extent.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace cairn::cli {

namespace {

constexpr Real kUnbounded = std::numeric_limits<Real>::infinity();

// That a step of sequential impulses may take: two solves a substep, but one in most of the textbook's.
Real most_sweeps(const WorldSettings& s) {
    const bool one = s.model.is_textbook() || s.stabilisation == Stabilisation::kTargetVelocity || s.stabilisation == Stabilisation::kNone;
    return static_cast<Real>(one ? 1 : 2) * s.iterations * s.substeps;
}

class Observer {
public:
    Observer(const Scene& scene, const RunOptions& options)
        : scene_(scene), dt_(options.dt), steps_(step_count(scene.duration, options.dt)) {
        prepare();
    }

    void see(Real t, const SceneWorld& built, const StepReport& report);
    Evidence finish();

private:
    using Manifolds = std::vector<ManifoldView>;
    bool is_dynamic(std::size_t i) const { return scene_.bodies[i].type == BodyType::kDynamic; }
    void prepare();
    void see_start(const Manifolds& manifolds);
    void find_supports(const Manifolds& manifolds);
    void find_support(std::size_t body, const Manifolds& manifolds);
    void see_pairs(const Manifolds& manifolds, bool is_first, bool is_late);
    void see_bodies(Real t, const SceneWorld& built);
    void see_joints(const SceneWorld& built);
    void see_islands(const SceneWorld& built, const StepReport& report);
    void join(std::size_t a, std::size_t b);
    std::size_t root(std::size_t i) const;
    void group_bodies();

    const Scene& scene_;
    Real dt_;
    long steps_;
    long step_ = 0;
    long late_steps_ = 0;
    Evidence e_;
    std::vector<std::size_t> parent_;
    std::vector<char> disturbed_;
    std::vector<BodyState> settled_, late_;  // by body
    bool has_settled_ = false;
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> pair_of_;
    std::map<std::size_t, GroupEvidence> islands_of_;  // by their lowest body
};

void Observer::prepare() {
    const Real g = scene_.gravity.norm();
    if (g > 0) e_.up = -scene_.gravity / g;
    e_.settle = std::min(limits::kSettle, scene_.duration / 4);
    const std::size_t n = scene_.bodies.size();
    e_.bodies.resize(n);
    e_.supports.resize(n);
    disturbed_.assign(n, false);
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (std::size_t i = 0; i < n; ++i) {
        const BodyDef& b = scene_.bodies[i];
        e_.bodies[i].radius = body_radius(b);
        e_.bodies[i].least = least_extent(b);
        const bool moves = !(b.linear_velocity.isZero(0) && b.angular_velocity.isZero(0) && b.force.isZero(0) && b.torque.isZero(0));
        disturbed_[i] = moves || b.motion.has_value();
    }
    e_.joints.resize(scene_.joints.size());
    for (std::size_t k = 0; k < scene_.joints.size(); ++k) {
        const SceneJoint& j = scene_.joints[k];
        const auto arm = [&](const std::optional<std::size_t>& body, const Vec3& anchor) {
            if (!body || !is_dynamic(*body)) return;
            disturbed_[*body] = true;  // what hangs may swing
            e_.joints[k].arm = std::max(e_.joints[k].arm, (anchor - scene_.bodies[*body].position).norm());
        };
        const bool is_rod = j.def.type == JointType::kDistance;
        arm(j.body_a, j.def.anchor_a);
        arm(j.body_b, is_rod ? j.def.anchor_b : j.def.anchor_a);
        if (is_rod) e_.joints[k].arm = std::max(e_.joints[k].arm, (j.def.anchor_a - j.def.anchor_b).norm());
        // A joint at the centre of mass has no arm of its own.
        if (e_.joints[k].arm == 0) {
            for (const std::optional<std::size_t>& body : {j.body_a, j.body_b})
                if (body && is_dynamic(*body)) e_.joints[k].arm = std::max(e_.joints[k].arm, e_.bodies[*body].radius);
        }
        if (j.body_a && j.body_b) join(*j.body_a, *j.body_b);
        // What has no shape is as large as its joints make it.
        for (const std::optional<std::size_t>& body : {j.body_a, j.body_b}) {
            if (!body || !scene_.bodies[*body].shapes.empty()) continue;
            e_.bodies[*body].radius = std::max(e_.bodies[*body].radius, e_.joints[k].arm);
            e_.bodies[*body].least = e_.bodies[*body].radius;
        }
    }
}

std::size_t Observer::root(std::size_t i) const {
    while (parent_[i] != i) i = parent_[i];
    return i;
}

void Observer::join(std::size_t a, std::size_t b) {
    if (!is_dynamic(a) || !is_dynamic(b)) return;
    const std::size_t p = root(a), q = root(b);
    parent_[std::max(p, q)] = std::min(p, q);
}

// A contact that bears: the bodies are together but for a hundredth of the thinner one.
bool bears(const ManifoldView& m, const Evidence& e) {
    Real gap = kUnbounded;
    for (int k = 0; k < m.count; ++k) gap = std::min(gap, m.points[k].separation);
    return gap <= 0.01 * std::min(e.bodies[m.body_a.index].least, e.bodies[m.body_b.index].least);
}

void Observer::see_start(const Manifolds& manifolds) {
    std::vector<char> held(scene_.bodies.size(), false);
    for (const ManifoldView& m : manifolds) {
        if (!bears(m, e_)) continue;
        const Real up = m.n.dot(e_.up);
        const std::size_t a = m.body_a.index, b = m.body_b.index;
        if (up > 0.1) held[a] = true;
        if (up < -0.1) held[b] = true;
        if (up > 0.5) e_.bodies[b].on_it.push_back(a);
        if (up < -0.5) e_.bodies[a].on_it.push_back(b);
    }
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i)
        if (is_dynamic(i) && !held[i]) disturbed_[i] = true;
    find_supports(manifolds);
}

void Observer::find_supports(const Manifolds& manifolds) {
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i)
        if (is_dynamic(i) && !disturbed_[i]) find_support(i, manifolds);
}

void Observer::find_support(std::size_t body, const Manifolds& manifolds) {
    Support& s = e_.supports[body];
    std::vector<char> borne(scene_.bodies.size(), false);
    s.borne = {body};
    borne[body] = true;
    for (std::size_t k = 0; k < s.borne.size(); ++k) {
        const std::size_t i = s.borne[k];
        s.mass += scene_.bodies[i].mass;
        s.centre += scene_.bodies[i].mass * scene_.bodies[i].position;
        for (const std::size_t j : e_.bodies[i].on_it) {
            if (!is_dynamic(j) || borne[j]) continue;
            borne[j] = true;
            s.borne.push_back(j);
        }
    }
    s.centre /= s.mass;
    std::vector<Vec3> normals;
    for (const ManifoldView& m : manifolds) {
        const bool a = borne[m.body_a.index], b = borne[m.body_b.index];
        if (a == b || !bears(m, e_)) continue;
        normals.push_back(a ? m.n : Vec3(-m.n));
        s.n += normals.back();
        s.friction = std::max(s.friction, m.friction);
        s.bearers.push_back(a ? m.body_b.index : m.body_a.index);
        for (int k = 0; k < m.count; ++k) s.points.push_back(0.5 * (m.points[k].position_a + m.points[k].position_b));
    }
    if (normals.empty()) return;
    s.n.normalize();
    s.is_plane = std::all_of(normals.begin(), normals.end(), [&](const Vec3& n) { return n.dot(s.n) >= limits::kOnePlane; });
}

void Observer::see_pairs(const Manifolds& manifolds, bool is_first, bool is_late) {
    for (const ManifoldView& m : manifolds) {
        const std::size_t a = m.body_a.index, b = m.body_b.index;
        Real depth = 0, impulse = 0;
        for (int k = 0; k < m.count; ++k) {
            depth = std::max(depth, -m.points[k].separation);
            impulse += m.points[k].normal_impulse;
        }
        if (impulse > 0) {
            join(a, b);
            const bool moves = disturbed_[a] || disturbed_[b];
            if (is_dynamic(a)) disturbed_[a] = moves;
            if (is_dynamic(b)) disturbed_[b] = moves;
        }
        if (!(depth > 0)) continue;
        const auto [it, is_new] = pair_of_.try_emplace({a, b}, e_.pairs.size());
        if (is_new) e_.pairs.push_back({a, b, m.n, 0, 0});
        PairEvidence& pair = e_.pairs[it->second];
        if (is_first) pair.start_depth = std::max(pair.start_depth, depth);
        if (is_late) pair.late_depth += depth;  // a sum until finish()
    }
}

void Observer::see_bodies(Real t, const SceneWorld& built) {
    std::vector<BodyState> now(scene_.bodies.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
        now[i] = built.world.state(built.ids[i]);
        BodyEvidence& b = e_.bodies[i];
        b.way_per_step = std::max(b.way_per_step, dt_ * now[i].linear_velocity.norm());
        b.turn_per_step = std::max(b.turn_per_step, dt_ * now[i].angular_velocity.norm());
        if (!built.world.is_enabled(built.ids[i]) && e_.disabled_body == SIZE_MAX) e_.disabled_body = i;
        if (!has_settled_) continue;
        const Real turned = is_dynamic(i) ? b.radius * angle_between(settled_[i].rotation, now[i].rotation) : 0;
        b.moved = std::max(b.moved, (now[i].position - settled_[i].position).norm() + turned);
    }
    if (!has_settled_ && t >= e_.settle) {
        has_settled_ = true;
        settled_ = now;
    }
    if (late_.empty() && 4 * step_ >= 3 * steps_) late_ = now;
    e_.end = std::move(now);
}

void Observer::see_joints(const SceneWorld& built) {
    for (std::size_t k = 0; k < e_.joints.size(); ++k) {
        const World::JointError error = built.world.joint_error({static_cast<std::uint32_t>(k), 0});
        e_.joints[k].error = std::max(e_.joints[k].error, error.position);
        e_.joints[k].angle = std::max(e_.joints[k].angle, error.angle);
        e_.joints[k].late_error = error.position;
    }
}

void Observer::see_islands(const SceneWorld& built, const StepReport& report) {
    const WorldSettings& settings = built.world.settings();
    for (const IslandReport& island : report.diagnostics->islands) {
        GroupEvidence& g = islands_of_[island.first_body.index];
        ++g.islands;
        ++g.solver_steps[static_cast<int>(island.solver)];
        if (island.solver == SolverChoice::kSi) {
            ++g.si_islands;
            // With a tolerance solves go on for as long as it takes.
            const bool capped = static_cast<Real>(island.iterations) >= limits::kAtCap * most_sweeps(settings);
            if (capped && settings.tolerance == 0) ++g.capped_islands;
        }
        if (island.residual.max <= g.residual) continue;
        g.residual = island.residual.max;
        g.worst_a = body_name(built.world, island.residual.body_a);
        g.worst_b = body_name(built.world, island.residual.body_b);
    }
}

void Observer::see(Real t, const SceneWorld& built, const StepReport& report) {
    ++step_;
    const bool is_late = 4 * step_ > 3 * steps_;
    late_steps_ += is_late;
    const Manifolds manifolds = built.world.manifolds();
    if (step_ == 1) see_start(manifolds);
    see_pairs(manifolds, step_ == 1, is_late);
    see_bodies(t, built);
    see_joints(built);
    see_islands(built, report);
    e_.ok = e_.ok && report.ok;
}

void Observer::group_bodies() {
    std::map<std::size_t, int> number;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        if (!is_dynamic(i)) continue;
        e_.bodies[i].group = number.try_emplace(root(i), static_cast<int>(number.size())).first->second;
    }
    e_.groups.resize(number.size());
    for (const auto& [first, part] : islands_of_) {
        GroupEvidence& g = e_.groups[static_cast<std::size_t>(e_.bodies[first].group)];
        if (part.residual > g.residual) {
            g.residual = part.residual;
            g.worst_a = part.worst_a;
            g.worst_b = part.worst_b;
        }
        g.si_islands += part.si_islands;
        g.capped_islands += part.capped_islands;
        g.islands += part.islands;
        for (int k = 0; k < kSolverChoices; ++k) g.solver_steps[k] += part.solver_steps[k];
    }
}

Evidence Observer::finish() {
    group_bodies();
    for (PairEvidence& pair : e_.pairs) pair.late_depth /= static_cast<Real>(std::max(1L, late_steps_));
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        BodyEvidence& b = e_.bodies[i];
        b.should_rest = is_dynamic(i) && !disturbed_[i] && !e_.up.isZero(0);
        if (!late_.empty()) b.late_speed = (e_.end[i].position - late_[i].position).norm() / (scene_.duration / 4);
    }
    return std::move(e_);
}

}  // namespace

Real body_radius(const BodyDef& body) {
    Real radius = 0;
    for (const Shape& s : body.shapes) radius = std::max(radius, bounding_radius(s));
    return radius;
}

Real least_extent(const BodyDef& body) {
    Real extent = kUnbounded;
    for (const Shape& s : body.shapes) extent = std::min(extent, cairn::least_extent(s));
    return extent;
}

Evidence observe(const Scene& scene, const RunOptions& options, const StepCallback& on_step) {
    RunOptions diagnosed = options;
    diagnosed.diagnostics = true;
    Observer observer(scene, diagnosed);
    std::string refused;
    try {
        run_scene(scene, diagnosed, {}, on_step,
                  [&](Real t, const SceneWorld& built, const StepReport& report) { observer.see(t, built, report); });
    } catch (const Error& error) {
        refused = error.what();
    }
    Evidence evidence = observer.finish();
    evidence.refused = refused;
    return evidence;
}

}  // namespace cairn::cli
