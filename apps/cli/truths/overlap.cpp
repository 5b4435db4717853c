#include "apps/cli/truths/overlap.hpp"

#include "collision/hull.hpp"
#include "collision/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn::cli {

namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

// A shape in the world, with what the directions are made from.
struct Placed {
    const Shape* shape = nullptr;
    Mat3 R = Mat3::Identity();
    Vec3 p = Vec3::Zero();
    std::vector<Vec3> points;   // polytopes: vertices; capsules: the ends of the segment; spheres: the centre
    std::vector<Vec3> normals;  // unit, of faces and caps
    std::vector<Vec3> edges;    // unit directions
    Real radius = 0;            // of the ball that is swept over the points
    bool is_round = false;      // cylinder: no finite set of directions is enough

    // Largest n·x.
    Real support(const Vec3& n) const {
        if (shape->type == ShapeType::kBox) return n.dot(p) + (R.transpose() * n).cwiseAbs().dot(shape->half_extents);
        if (is_round) {
            const Real z = n.dot(R.col(2));
            return n.dot(p) + std::abs(z) * shape->half_height + shape->radius * std::sqrt(std::max(0.0, n.squaredNorm() - z * z));
        }
        Real most = -kInfinity;
        for (const Vec3& x : points) most = std::max(most, n.dot(x));
        return most + radius;
    }
};

void add_direction(std::vector<Vec3>& list, const Vec3& v) {
    if (const Real length = v.norm(); length > 1e-9) list.push_back(v / length);
}

Placed place(const Shape& s, const Pose& X_WB) {
    Placed out;
    out.shape = &s;
    const Pose X = X_WB * s.X_BS;
    out.R = X.q.normalized().toRotationMatrix();
    out.p = X.p;
    switch (s.type) {
        case ShapeType::kSphere:
            out.points = {X.p};
            out.radius = s.radius;
            break;
        case ShapeType::kCapsule:
            out.points = {X.p + s.half_height * out.R.col(2), X.p - s.half_height * out.R.col(2)};
            out.edges = {out.R.col(2)};
            out.radius = s.radius;
            break;
        case ShapeType::kBox:
            for (int k = 0; k < 3; ++k) {
                out.normals.push_back(out.R.col(k));
                out.edges.push_back(out.R.col(k));
            }
            for (int corner = 0; corner < 8; ++corner) {
                const Vec3 sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
                out.points.push_back(X.p + out.R * sign.cwiseProduct(s.half_extents));
            }
            break;
        case ShapeType::kCylinder:
            out.normals = {out.R.col(2)};
            out.is_round = true;
            break;
        case ShapeType::kHull:
            for (const Vec3& v : s.hull->vertices()) out.points.push_back(X.p + out.R * v);
            for (const ConvexHull::Face& face : s.hull->faces()) {
                out.normals.push_back(out.R * face.normal);
                for (int k = 0; k < face.count; ++k) {
                    const int from = s.hull->loop()[static_cast<std::size_t>(face.first + k)];
                    const int to = s.hull->loop()[static_cast<std::size_t>(face.first + (k + 1) % face.count)];
                    if (from < to)
                        add_direction(out.edges,
                                      Vec3(out.points[static_cast<std::size_t>(to)] - out.points[static_cast<std::size_t>(from)]));
                }
            }
            break;
        case ShapeType::kPlane:
        case ShapeType::kMesh:
            break;
    }
    return out;
}

// Overlap along n, from A towards B.
Real along(const Placed& a, const Placed& b, const Vec3& n) {
    return a.support(n) + b.support(-n);
}

// The smaller of both signs of n, with n set to that sign.
Real along_either(const Placed& a, const Placed& b, Vec3& n) {
    const Real there = along(a, b, n), back = along(a, b, -n);
    if (back < there) n = -n;
    return std::min(there, back);
}

// Goes down from n by tries to four sides, shorter each time none is better.
Real descend(const Placed& a, const Placed& b, Vec3 n, Real value) {
    for (Real reach = 0.2; reach > 1e-9;) {
        const Vec3 t = any_perpendicular(n), u = n.cross(t);
        Vec3 best = n;
        Real least = value;
        for (const Vec3& way : {t, Vec3(-t), u, Vec3(-u), Vec3((t + u) / 2), Vec3((t - u) / 2), Vec3((u - t) / 2), Vec3((-t - u) / 2)}) {
            const Vec3 candidate = (n + reach * way).normalized();
            const Real there = along(a, b, candidate);
            if (there < least) {
                least = there;
                best = candidate;
            }
        }
        if (least < value) {
            value = least;
            n = best;
            if (value <= 0) return value;
        } else {
            reach /= 3;
        }
    }
    return value;
}

// Directions in which the least overlap can lie: faces, pairs of edges, and from points to points for rounded shapes.
std::vector<Vec3> directions(const Placed& a, const Placed& b) {
    std::vector<Vec3> list;
    add_direction(list, Vec3(b.p - a.p));
    list.insert(list.end(), a.normals.begin(), a.normals.end());
    list.insert(list.end(), b.normals.begin(), b.normals.end());
    for (const Vec3& x : a.edges) {
        for (const Vec3& y : b.edges) add_direction(list, x.cross(y));
    }
    const bool rounded = a.radius > 0 || b.radius > 0 || a.is_round || b.is_round;
    if (!rounded) return list;
    const auto centres = [](const Placed& s) { return s.points.empty() ? std::vector<Vec3>{s.p} : s.points; };
    for (const Vec3& x : centres(a)) {
        for (const Vec3& y : centres(b)) add_direction(list, Vec3(y - x));
    }
    for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
        const Vec3 axis = one->R.col(2);
        if (!one->is_round && one->shape->type != ShapeType::kCapsule) continue;
        const Vec3 way = other->p - one->p;
        add_direction(list, Vec3(way - way.dot(axis) * axis));
        for (const Vec3& edge : other->edges) add_direction(list, axis.cross(edge));
        if (other->is_round) add_direction(list, axis.cross(Vec3(other->R.col(2))));
    }
    return list;
}

Real least_overlap(const Placed& a, const Placed& b) {
    std::vector<std::pair<Real, Vec3>> found;
    for (Vec3 n : directions(a, b)) {
        const Real value = along_either(a, b, n);
        if (value <= 0) return 0;
        found.emplace_back(value, n);
    }
    const bool exact = !a.is_round && !b.is_round && a.radius == 0 && b.radius == 0;
    const std::size_t starts = std::min<std::size_t>(found.size(), exact ? 1 : 6);
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(starts), found.end(),
                      [](const auto& x, const auto& y) { return x.first < y.first; });
    Real least = found.front().first;
    if (exact) return least;
    for (std::size_t k = 0; k < starts; ++k) least = std::min(least, descend(a, b, found[k].second, found[k].first));
    return std::max(0.0, least);
}

Real ball_in_box(const Placed& ball, const Placed& box) {
    const Vec3 c = box.R.transpose() * (ball.p - box.p);
    const Vec3 out = c.cwiseAbs() - box.shape->half_extents;
    const Real beyond = out.cwiseMax(0).norm();
    return std::max(0.0, ball.radius - (beyond > 0 ? beyond : out.maxCoeff()));
}

Real placed_depth(const Placed& a, const Placed& b) {
    const ShapeType x = a.shape->type, y = b.shape->type;
    if (x == ShapeType::kSphere && y == ShapeType::kSphere) return std::max(0.0, a.radius + b.radius - (a.p - b.p).norm());
    if (x == ShapeType::kSphere && y == ShapeType::kBox) return ball_in_box(a, b);
    if (x == ShapeType::kBox && y == ShapeType::kSphere) return ball_in_box(b, a);
    return least_overlap(a, b);
}

Real plane_depth(const Shape& plane, const Pose& X_WP, const Placed& other) {
    const Vec3 n = X_WP.q.normalized() * plane.normal;
    return std::max(0.0, plane.offset + n.dot(X_WP.p) + other.support(-n));
}

struct Entry {
    Placed placed;
    std::size_t body = 0;
    Vec3 low = Vec3::Zero(), high = Vec3::Zero();
};

// All shapes with an inside, in order of their boxes' lower x.
std::vector<Entry> entries_of(const Scene& scene, const std::vector<BodyState>& states) {
    std::vector<Entry> entries;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        for (const Shape& s : scene.bodies[i].shapes) {
            if (s.is_static_only()) continue;
            Entry& e = entries.emplace_back(Entry{place(s, {states[i].rotation, states[i].position}), i});
            for (int k = 0; k < 3; ++k) {
                e.low[k] = -e.placed.support(-Vec3::Unit(k));
                e.high[k] = e.placed.support(Vec3::Unit(k));
            }
        }
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.low.x() < b.low.x(); });
    return entries;
}

// Pairs of bodies that never touch, sorted.
std::vector<std::pair<std::size_t, std::size_t>> pairs_apart(const Scene& scene) {
    std::vector<std::pair<std::size_t, std::size_t>> apart;
    for (const SceneJoint& j : scene.joints) {
        if (j.body_a && j.body_b && !j.def.collide_connected) apart.push_back(std::minmax(*j.body_a, *j.body_b));
    }
    std::sort(apart.begin(), apart.end());
    return apart;
}

// All pairs of one sample: worst[i] becomes body i's deepest.
void sample_depths(const Scene& scene, const std::vector<BodyState>& states, const std::vector<std::pair<std::size_t, std::size_t>>& apart,
                   std::vector<Real>& worst) {
    const std::vector<Entry> entries = entries_of(scene, states);
    std::vector<std::pair<const Shape*, std::size_t>> planes;
    const auto pose = [&](std::size_t i) { return Pose{states[i].rotation, states[i].position}; };
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        for (const Shape& s : scene.bodies[i].shapes) {
            if (s.type == ShapeType::kPlane) planes.emplace_back(&s, i);
        }
    }
    const auto is_dynamic = [&](std::size_t i) { return scene.bodies[i].type == BodyType::kDynamic; };
    const auto note = [&](std::size_t i, std::size_t j, Real depth) {
        worst[i] = std::max(worst[i], depth);
        worst[j] = std::max(worst[j], depth);
    };
    for (const auto& [plane, owner] : planes) {
        for (const Entry& e : entries) {
            if (is_dynamic(e.body)) note(owner, e.body, plane_depth(*plane, pose(owner), e.placed));
        }
    }
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const Entry& a = entries[i];
        for (std::size_t j = i + 1; j < entries.size() && entries[j].low.x() <= a.high.x(); ++j) {
            const Entry& b = entries[j];
            if (a.body == b.body || !(is_dynamic(a.body) || is_dynamic(b.body))) continue;
            if ((a.low.array() > b.high.array()).any() || (b.low.array() > a.high.array()).any()) continue;
            const std::pair<std::size_t, std::size_t> pair = std::minmax(a.body, b.body);
            if (std::binary_search(apart.begin(), apart.end(), pair)) continue;
            note(a.body, b.body, placed_depth(a.placed, b.placed));
        }
    }
}

}  // namespace

Real overlap_depth(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB) {
    if (a.type == ShapeType::kPlane) return plane_depth(a, X_WA, place(b, X_WB));
    if (b.type == ShapeType::kPlane) return plane_depth(b, X_WB, place(a, X_WA));
    return placed_depth(place(a, X_WA), place(b, X_WB));
}

namespace {

// The least overlap and its direction, from A towards B; negative: a distance, never more than the true one.
Real least_along(const Placed& a, const Placed& b, Vec3& best) {
    Real least = kInfinity;
    for (Vec3 n : directions(a, b)) {
        const Real value = along_either(a, b, n);
        if (value >= least) continue;
        least = value;
        best = n;
    }
    return least;
}

// Distance of the boxes around an entry and the nearest triangle of a mesh.
Real mesh_gap(const Shape& mesh, const Pose& X_WB, const Entry& e) {
    const Pose X = X_WB * mesh.X_BS;
    Real least = kInfinity;
    for (const std::array<int, 3>& triangle : mesh.mesh->triangles()) {
        Vec3 low = Vec3::Constant(kInfinity), high = -low;
        for (const int v : triangle) {
            const Vec3 x = X.p + X.q * mesh.mesh->vertices()[static_cast<std::size_t>(v)];
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
        least = std::min(least, (low - e.high).cwiseMax(e.low - high).cwiseMax(0).norm());
    }
    return least;
}

}  // namespace

std::vector<Real> support_gaps(const Scene& scene, const std::vector<BodyState>& states) {
    constexpr Real kUpwards = 0.02, kTouching = 1e-4;  // the normal of what touches is not known well: there, who is higher counts
    std::vector<Real> gaps(scene.bodies.size(), kSupportReach);
    const Vec3 up = -scene.gravity.normalized();
    const std::vector<Entry> entries = entries_of(scene, states);
    const std::vector<std::pair<std::size_t, std::size_t>> apart = pairs_apart(scene);
    const auto note = [&gaps](std::size_t body, Real gap) { gaps[body] = std::min(gaps[body], std::max(0.0, gap)); };
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const Pose X{states[i].rotation, states[i].position};
        for (const Shape& s : scene.bodies[i].shapes) {
            if (!s.is_static_only()) continue;
            const Vec3 n = X.q * s.normal;
            if (s.type == ShapeType::kPlane && !(n.dot(up) > kUpwards)) continue;
            for (const Entry& e : entries) {
                note(e.body, s.type == ShapeType::kPlane ? -e.placed.support(-n) - s.offset - n.dot(X.p) : mesh_gap(s, X, e));
            }
        }
    }
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const Entry& a = entries[i];
        for (std::size_t j = i + 1; j < entries.size() && entries[j].low.x() <= a.high.x() + kSupportReach; ++j) {
            const Entry& b = entries[j];
            if (a.body == b.body || ((a.low - b.high).cwiseMax(b.low - a.high).array() > kSupportReach).any()) continue;
            if (std::binary_search(apart.begin(), apart.end(), std::pair<std::size_t, std::size_t>(std::minmax(a.body, b.body)))) continue;
            Vec3 n = up;
            const Real gap = -least_along(a.placed, b.placed, n);
            const Real rise = n.dot(up), higher = (states[b.body].position - states[a.body].position).dot(up);
            if (rise > kUpwards || (gap < kTouching && higher > 0)) note(b.body, gap);
            if (rise < -kUpwards || (gap < kTouching && higher < 0)) note(a.body, gap);
        }
    }
    return gaps;
}

PenetrationError penetration_error(const Scene& scene, const History& history) {
    const std::vector<std::pair<std::size_t, std::size_t>> apart = pairs_apart(scene);
    std::vector<Real> depths;
    for (std::size_t k = 0; k < history.t.size(); ++k) {
        if (history.t[k] < 1e-9) continue;
        std::vector<Real> worst(scene.bodies.size(), 0);
        sample_depths(scene, history.states[k], apart, worst);
        for (std::size_t i = 0; i < worst.size(); ++i) {
            if (scene.bodies[i].type == BodyType::kDynamic) depths.push_back(worst[i]);
        }
    }
    PenetrationError error;
    if (depths.empty()) return error;
    std::sort(depths.begin(), depths.end());
    error.deepest = depths.back();
    // The 99th percentile, linear between the two values beside it.
    const Real at = 0.99 * static_cast<Real>(depths.size() - 1);
    const std::size_t below = static_cast<std::size_t>(at);
    const Real above = depths[std::min(below + 1, depths.size() - 1)];
    error.percentile99 = depths[below] + (at - static_cast<Real>(below)) * (above - depths[below]);
    return error;
}

}  // namespace cairn::cli
