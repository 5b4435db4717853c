// Causes that lie in the scene: overlaps, joints that are too short, slopes that are too steep, support that ends. No solver can help.
#include "apps/cli/diagnose/diagnose.hpp"
#include "apps/cli/diagnose/limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn::cli {

namespace {

Real degrees(Real angle) {
    return 180 / kPi * angle;
}

std::string list_names(const Scene& scene, const std::vector<std::size_t>& bodies) {
    std::string names;
    for (const std::size_t i : bodies) names += (names.empty() ? "" : ", ") + scene.bodies[i].name;
    return names;
}

// The bodies of the symptom's group, with something that bears them in a plane.
template <typename Function>
void for_each_support(const Case& c, const Symptom& s, Function f) {
    for (std::size_t i = 0; i < c.evidence.bodies.size(); ++i)
        if (c.evidence.bodies[i].group == s.group && c.evidence.supports[i].is_plane) f(i, c.evidence.supports[i]);
}

// Of convex position, counter-clockwise (Andrew's monotone chain).
std::vector<Eigen::Vector2d> hull_of(std::vector<Eigen::Vector2d> p) {
    std::sort(p.begin(), p.end(), [](const auto& a, const auto& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
    const auto turns_left = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& q) {
        return (b.x() - a.x()) * (q.y() - a.y()) - (b.y() - a.y()) * (q.x() - a.x()) > 0;
    };
    std::vector<Eigen::Vector2d> hull;
    for (int pass = 0; pass < 2; ++pass) {
        const std::size_t start = hull.size();
        for (const Eigen::Vector2d& q : p) {
            while (hull.size() >= start + 2 && !turns_left(hull[hull.size() - 2], hull.back(), q)) hull.pop_back();
            hull.push_back(q);
        }
        hull.pop_back();
        std::reverse(p.begin(), p.end());
    }
    if (hull.empty() && !p.empty()) hull.push_back(p.front());
    return hull;
}

Real distance_to_segment(const Eigen::Vector2d& q, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector2d d = b - a;
    const Real length2 = d.squaredNorm(), t = length2 > 0 ? std::clamp((q - a).dot(d) / length2, 0.0, 1.0) : 0;
    return (q - a - t * d).norm();
}

// How far q is inside the convex polygon; negative outside.
Real margin_in(const std::vector<Eigen::Vector2d>& hull, const Eigen::Vector2d& q) {
    Real nearest = std::numeric_limits<Real>::infinity();
    bool inside = hull.size() >= 3;
    for (std::size_t k = 0; k < hull.size(); ++k) {
        const Eigen::Vector2d &a = hull[k], &b = hull[(k + 1) % hull.size()];
        nearest = std::min(nearest, distance_to_segment(q, a, b));
        if ((b.x() - a.x()) * (q.y() - a.y()) - (b.y() - a.y()) * (q.x() - a.x()) < 0) inside = false;
    }
    return inside ? nearest : -nearest;
}

// Seen along gravity: the support and the centre of mass over it.
struct Footing {
    Vec3 x, y;  // horizontal
    std::vector<Eigen::Vector2d> hull;
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    Real margin = 0;
};

Footing footing_of(const Support& s, const Vec3& up) {
    Footing f;
    f.x = any_perpendicular(up);
    f.y = up.cross(f.x);
    std::vector<Eigen::Vector2d> points;
    for (const Vec3& p : s.points) points.emplace_back(f.x.dot(p), f.y.dot(p));
    f.hull = hull_of(std::move(points));
    f.centre = {f.x.dot(s.centre), f.y.dot(s.centre)};
    f.margin = margin_in(f.hull, f.centre);
    return f;
}

// What rests on a point or a line: round bodies are held by rolling friction, others by nothing. On a slope the torque m g d about the
// point, d its distance from the centre of mass seen along gravity, is met by ρ N with N = m g n·up.
void brake(const Scene& scene, const Support& s, Real distance, const Vec3& up, Finding& f) {
    const std::size_t body = s.borne.front();
    const std::vector<Shape>& shapes = scene.bodies[body].shapes;
    const bool is_round = std::all_of(shapes.begin(), shapes.end(), [](const Shape& shape) {
        return shape.type == ShapeType::kSphere || shape.type == ShapeType::kCapsule || shape.type == ShapeType::kCylinder;
    });
    if (!is_round) {
        f.no_cure = "no setting holds it there: give it a face to rest on";
        return;
    }
    const Real wanted = 1.1 * distance / s.n.dot(up);
    f.cures.push_back({fmt::format("rolling_friction {:.3g} of {} in the scene", wanted, scene.bodies[body].name),
                       [body, wanted](Scene& changed, RunOptions&) { changed.bodies[body].rolling_friction = wanted; }});
}

// The shortest way between two anchors along bodies and rods: what joins them cannot be longer than it.
struct Ends {
    Vec3 p[2];            // [m], where the anchors are at the end of the run
    bool fixed[2];        // held by what no force moves
    std::size_t body[2];  // SIZE_MAX: the world
};

Vec3 anchor_now(const Case& c, const std::optional<std::size_t>& body, const Vec3& anchor) {
    if (!body) return anchor;
    const BodyDef& start = c.scene.bodies[*body];
    const BodyState& end = c.evidence.end[*body];
    return end.position + end.rotation * (start.rotation.normalized().conjugate() * (anchor - start.position));
}

std::vector<Ends> joint_ends(const Case& c) {
    std::vector<Ends> ends;
    for (const SceneJoint& j : c.scene.joints) {
        Ends e;
        const std::optional<std::size_t> bodies[2] = {j.body_a, j.body_b};
        for (int side = 0; side < 2; ++side) {
            const bool rod_end = j.def.type == JointType::kDistance && side == 1;
            e.p[side] = anchor_now(c, bodies[side], rod_end ? j.def.anchor_b : j.def.anchor_a);
            e.fixed[side] = !bodies[side] || c.scene.bodies[*bodies[side]].type != BodyType::kDynamic;
            e.body[side] = bodies[side].value_or(SIZE_MAX);
        }
        ends.push_back(e);
    }
    return ends;
}

// Longest way that a chain from side `from` of joint `start` may bridge to each side of each joint: Bellman and Ford's shortest paths, in
// which a body costs the distance of its two anchors and a rod its length; a slider leads as far as you like.
std::vector<Real> reaches(const Case& c, const std::vector<Ends>& ends, std::size_t start, int from) {
    constexpr Real kFar = std::numeric_limits<Real>::infinity();
    std::vector<Real> reach(2 * ends.size(), kFar);
    reach[2 * start + static_cast<std::size_t>(from)] = 0;
    for (bool changes = true; changes;) {
        changes = false;
        const auto relax = [&](std::size_t to, Real value) {
            if (!(value < reach[to])) return;
            reach[to] = value;
            changes = true;
        };
        for (std::size_t k = 0; k < ends.size(); ++k) {
            const SceneJoint& j = c.scene.joints[k];
            const Real across = j.def.type == JointType::kSlider     ? kFar
                                : j.def.type == JointType::kDistance ? (j.def.anchor_a - j.def.anchor_b).norm()
                                                                     : 0;
            for (const std::size_t side : {0u, 1u}) {
                relax(2 * k + 1 - side, reach[2 * k + side] + across);
                if (ends[k].fixed[side]) continue;
                for (std::size_t m = 0; m < ends.size(); ++m)
                    for (const std::size_t other : {0u, 1u})
                        if (ends[m].body[other] == ends[k].body[side])
                            relax(2 * m + other, reach[2 * k + side] + (ends[m].p[other] - ends[k].p[side]).norm());
            }
        }
    }
    return reach;
}

}  // namespace

std::vector<Finding> find_overlaps(const Case& c) {
    std::vector<Finding> findings;
    for (const PairEvidence& p : c.evidence.pairs) {
        const Real least = std::min(c.evidence.bodies[p.a].least, c.evidence.bodies[p.b].least);
        if (p.start_depth < limits::kOverlap * least) continue;
        const BodyDef &a = c.scene.bodies[p.a], &b = c.scene.bodies[p.b];
        // The upper one of two that can be moved.
        const bool both = a.type == BodyType::kDynamic && b.type == BodyType::kDynamic;
        const bool moves_a = both ? p.n.dot(c.evidence.up) >= 0 : a.type == BodyType::kDynamic;
        const std::size_t moved = moves_a ? p.a : p.b;
        const Vec3 way = (moves_a ? p.start_depth : -p.start_depth) * p.n + Vec3::Zero();  // no −0
        Finding f;
        f.cause = "overlap";
        f.says = fmt::format("{} and {} overlap by {:.3g} m at the start, {:.0f} % of the thinner one", a.name, b.name, p.start_depth,
                             100 * p.start_depth / least);
        f.bodies = {a.name, b.name};
        Symptom s;
        s.kind = SymptomKind::kSinks;
        s.index = moved;
        s.other = moves_a ? p.b : p.a;
        s.group = c.evidence.bodies[moved].group;
        s.value = p.start_depth;
        s.limit = limits::kOverlap * least;
        f.symptom = s;
        f.cures.push_back(
            {fmt::format("move {} by [{:.4g}, {:.4g}, {:.4g}] m in the scene", c.scene.bodies[moved].name, way.x(), way.y(), way.z()),
             [moved, way](Scene& scene, RunOptions&) { scene.bodies[moved].position += way; }});
        findings.push_back(std::move(f));
    }
    return findings;
}

std::optional<Finding> find_reach(const Case& c, const Symptom& symptom) {
    if (symptom.kind != SymptomKind::kStretches || c.evidence.end.empty()) return std::nullopt;
    const std::vector<Ends> ends = joint_ends(c);
    const auto name = [&](std::size_t body) { return body == SIZE_MAX ? std::string("the world") : c.scene.bodies[body].name; };
    Finding f;
    Real worst = 0;
    for (std::size_t k = 0; k < ends.size(); ++k) {
        for (const std::size_t side : {0u, 1u}) {
            if (!ends[k].fixed[side]) continue;
            const std::vector<Real> reach = reaches(c, ends, k, static_cast<int>(side));
            for (std::size_t m = 0; m < 2 * ends.size(); ++m) {
                const Ends& e = ends[m / 2];
                const Real distance = (e.p[m % 2] - ends[k].p[side]).norm();
                if (!e.fixed[m % 2] || !(distance - reach[m] > std::max(worst, limits::kReach * reach[m]))) continue;
                worst = distance - reach[m];
                f.says = fmt::format("what joins {} and {} reaches {:.4g} m, but they hold its ends {:.4g} m apart",
                                     name(ends[k].body[side]), name(e.body[m % 2]), reach[m], distance);
                f.bodies = {name(ends[k].body[side]), name(e.body[m % 2])};
            }
        }
    }
    if (worst == 0) return std::nullopt;
    f.cause = "reach";
    f.symptom = symptom;
    f.no_cure = "no setting makes it longer: lengthen it, or let its ends stay nearer";
    return f;
}

std::optional<Finding> find_steep_slope(const Case& c, const Symptom& symptom) {
    if (symptom.kind != SymptomKind::kMoves) return std::nullopt;
    std::optional<Finding> found;
    Real worst = 0;
    for_each_support(c, symptom, [&](std::size_t, const Support& s) {
        const Real cosine = s.n.dot(c.evidence.up), slope = s.n.cross(c.evidence.up).norm() / cosine;
        if (!(cosine > 0) || !(slope > limits::kSteep * s.friction) || slope < 1e-6 || slope - s.friction < worst) return;
        worst = slope - s.friction;
        Finding f;
        f.cause = "friction";
        f.says =
            fmt::format("{} stands on a slope of {:.3g}°, whose tangent {:.3g} is {} μ = {:.3g} of the pair: it slides",
                        list_names(c.scene, s.borne), degrees(std::atan(slope)), slope, slope > s.friction ? "above" : "at", s.friction);
        for (const std::size_t i : s.borne) f.bodies.push_back(c.scene.bodies[i].name);
        for (const std::size_t i : s.bearers) f.bodies.push_back(c.scene.bodies[i].name);
        f.symptom = symptom;
        const Real wanted = 1.1 * slope;
        std::vector<std::size_t> changed = s.bearers;
        changed.push_back(s.borne.front());
        f.cures.push_back({fmt::format("friction {:.3g} of {} in the scene", wanted, list_names(c.scene, changed)),
                           [changed, wanted](Scene& scene, RunOptions&) {
                               for (const std::size_t i : changed) scene.bodies[i].friction = wanted;
                           }});
        found = std::move(f);
    });
    return found;
}

std::optional<Finding> find_weak_support(const Case& c, const Symptom& symptom) {
    if (symptom.kind != SymptomKind::kMoves) return std::nullopt;
    std::optional<Finding> found;
    Real worst = std::numeric_limits<Real>::infinity();
    for_each_support(c, symptom, [&](std::size_t body, const Support& s) {
        const Footing footing = footing_of(s, c.evidence.up);
        const Real relative = footing.margin / c.evidence.bodies[body].radius;
        if (relative > limits::kEdge || relative >= worst) return;
        // A ball may well rest on its point; only if it is the one that moves.
        const bool is_it = std::find(s.borne.begin(), s.borne.end(), symptom.index) != s.borne.end();
        if (relative >= -limits::kEdge && !is_it) return;
        worst = relative;
        Finding f;
        f.cause = "support";
        const std::string what = s.borne.size() == 1 ? fmt::format("the centre of mass of {}", c.scene.bodies[body].name)
                                                     : fmt::format("the common centre of mass of {}", list_names(c.scene, s.borne));
        const char* shape = footing.hull.size() >= 3   ? "its support"
                            : footing.hull.size() == 2 ? "the edge it rests on"
                                                       : "the point it rests on";
        f.says = relative < -limits::kEdge
                     ? fmt::format("{} is {:.3g} m beside {}: it topples or rolls", what, -footing.margin, shape)
                     : fmt::format("{} is over {} (within {:.2g} m): nothing keeps it there", what,
                                   footing.hull.size() >= 3 ? "the edge of its support" : shape, std::abs(footing.margin));
        for (const std::size_t i : s.borne) f.bodies.push_back(c.scene.bodies[i].name);
        f.symptom = symptom;
        if (footing.hull.size() < 3) {
            brake(c.scene, s, std::abs(footing.margin), c.evidence.up, f);
            found = std::move(f);
            return;
        }
        Eigen::Vector2d middle = Eigen::Vector2d::Zero();
        for (const Eigen::Vector2d& p : footing.hull) middle += p / static_cast<Real>(footing.hull.size());
        const Eigen::Vector2d by = middle - footing.centre;
        const Vec3 way = by.x() * footing.x + by.y() * footing.y + Vec3::Zero();  // no −0
        f.cures.push_back(
            {fmt::format("move {} by [{:.3g}, {:.3g}, {:.3g}] m in the scene", list_names(c.scene, s.borne), way.x(), way.y(), way.z()),
             [borne = s.borne, way](Scene& scene, RunOptions&) {
                 for (const std::size_t i : borne) scene.bodies[i].position += way;
             }});
        found = std::move(f);
    });
    return found;
}

}  // namespace cairn::cli
