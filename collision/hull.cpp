#include "collision/hull.hpp"

#include "collision/mass_properties.hpp"
#include "collision/qhull_triangles.hpp"
#include "engine/base/error.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <string>
#include <unordered_map>

namespace cairn {
namespace {

using Triangle = std::array<int, 3>;
using Pair = double __attribute__((vector_size(16)));

Pair load(const Real* p) {
    return Pair{p[0], p[1]};
}

// Two and two, x x y y z z; the last one twice if their number is odd.
std::vector<Real> paired(const std::vector<Vec3>& v) {
    std::vector<Real> out;
    for (std::size_t i = 0; i < v.size(); i += 2)
        for (int k = 0; k < 3; ++k) {
            out.push_back(v[i][k]);
            out.push_back(v[std::min(i + 1, v.size() - 1)][k]);
        }
    return out;
}

// The first of `count` paired vectors that goes farthest along d: the largest product (summed as Eigen does) first, two at a time; then the
// first that has it, which is as likely to be any and so not asked on the way.
int farthest_of(const std::vector<Real>& vectors, int count, const Vec3& d) {
    constexpr int kMost = 64;  // pairs whose products are kept
    const Pair x = {d.x(), d.x()}, y = {d.y(), d.y()}, z = {d.z(), d.z()};
    const auto product = [&](int i) {
        const Real* c = vectors.data() + 6 * i;
        return (x * load(c) + y * load(c + 2)) + z * load(c + 4);
    };
    const int pairs = (count + 1) / 2;
    Pair kept[kMost];
    Pair most = kept[0] = product(0);
    for (int i = 1; i < std::min(pairs, kMost); ++i) {
        kept[i] = product(i);
        most = kept[i] > most ? kept[i] : most;
    }
    for (int i = kMost; i < pairs; ++i) {
        const Pair along = product(i);
        most = along > most ? along : most;
    }
    const Real farthest = most[0] > most[1] ? most[0] : most[1];
    for (int i = 0; i < pairs; ++i) {
        const Pair along = i < kMost ? kept[i] : product(i);
        if (along[0] == farthest) return 2 * i;
        if (along[1] == farthest) return 2 * i + 1;
    }
    return 0;  // not finite
}

// All relative to the largest half extent of the points.
constexpr Real kMergeTolerance = 1e-7;    // vertices this near a face's plane are on it; nearer vertices than this are one
constexpr Real kFinestTolerance = 1e-11;  // second try, when the first one folds faces over each other
constexpr Real kFlat = 1e-6;              // thinner hulls have no volume

void check_points(const std::vector<Vec3>& points) {
    if (points.size() < 4) throw_invalid("convex hull, number of points", static_cast<double>(points.size()), ">= 4");
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (is_finite(points[i])) continue;
        const auto bad = std::find_if(points[i].begin(), points[i].end(), [](Real x) { return !std::isfinite(x); });
        throw_invalid("convex hull point " + std::to_string(i), *bad, "finite");
    }
}

[[noreturn]] void throw_flat(Real thickness, Real extent) {
    throw_invalid("convex hull thickness / extent", extent > 0 ? thickness / extent : 0.0, "> 1e-6: the points enclose no volume");
}

// The points moved and scaled into [−1, 1]³, so that nothing below depends on the unit of length.
std::vector<Vec3> normalized_points(const std::vector<Vec3>& points) {
    Vec3 lo = points[0], hi = points[0];
    for (const Vec3& p : points) lo = lo.cwiseMin(p), hi = hi.cwiseMax(p);
    const Vec3 centre = lo / 2 + hi / 2;
    const Real extent = (hi / 2 - lo / 2).maxCoeff();
    if (!(extent > 0)) throw_flat(0, 0);
    std::vector<Vec3> out(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = (points[i] - centre) / extent;
    return out;
}

Vec3 area_vector(const std::vector<Vec3>& points, const Triangle& t) {
    return (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
}

// Indices of the vertices in use, ascending, of those nearer than the tolerance only the first.
std::vector<int> welded_vertices(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
    std::vector<int> used;
    for (const Triangle& t : triangles) used.insert(used.end(), t.begin(), t.end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());

    std::vector<int> kept;
    for (const int i : used) {
        const auto same = [&](int j) { return (points[i] - points[j]).cwiseAbs().maxCoeff() <= kMergeTolerance; };
        if (std::none_of(kept.begin(), kept.end(), same)) kept.push_back(i);
    }
    return kept;
}

// A triangulated closed surface, its coplanar triangles gathered into faces.
class FaceMerger {
public:
    FaceMerger(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) : points_(points), triangles_(triangles) {}

    // Loops of vertex indices, counter-clockwise, each starting at its smallest index, in ascending order; empty if the surface is not
    // closed, or a face came out as anything but a simple loop of three or more corners.
    std::vector<std::vector<int>> loops(Real tolerance) {
        if (!link()) return {};
        gather(tolerance);
        return trace();
    }

private:
    static std::uint64_t key(int u, int v) { return (static_cast<std::uint64_t>(u) << 32) | static_cast<std::uint32_t>(v); }

    // Which triangle owns each directed edge. False if an edge is used twice or has no twin.
    bool link() {
        owner_.clear();
        for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
            for (int k = 0; k < 3; ++k)
                if (!owner_.emplace(key(triangles_[t][k], triangles_[t][(k + 1) % 3]), t).second) return false;
        for (const Triangle& t : triangles_)
            for (int k = 0; k < 3; ++k)
                if (!owner_.contains(key(t[(k + 1) % 3], t[k]))) return false;
        return !triangles_.empty();
    }

    int across(int triangle, int k) const { return owner_.at(key(triangles_[triangle][(k + 1) % 3], triangles_[triangle][k])); }

    // Grows faces from the largest triangles, whose planes are the best known; slivers join whatever face they lie on.
    void gather(Real tolerance) {
        const int count = static_cast<int>(triangles_.size());
        std::vector<Real> area(count);
        for (int t = 0; t < count; ++t) area[t] = area_vector(points_, triangles_[t]).squaredNorm();
        std::vector<int> seeds(count);
        std::iota(seeds.begin(), seeds.end(), 0);
        std::stable_sort(seeds.begin(), seeds.end(), [&](int a, int b) { return area[a] > area[b]; });

        face_.assign(count, -1);
        face_count_ = 0;
        for (const int seed : seeds)
            if (face_[seed] < 0) grow(seed, face_count_++, tolerance);
    }

    void grow(int seed, int face, Real tolerance) {
        const Vec3 n = area_vector(points_, triangles_[seed]).normalized();
        const Vec3& origin = points_[triangles_[seed][0]];
        const auto on_plane = [&](int i) { return std::abs(n.dot(points_[i] - origin)) <= tolerance; };
        face_[seed] = face;
        for (std::vector<int> stack{seed}; !stack.empty();) {
            const int t = stack.back();
            stack.pop_back();
            for (int k = 0; k < 3; ++k) {
                const int other = across(t, k);
                if (face_[other] >= 0 || !std::all_of(triangles_[other].begin(), triangles_[other].end(), on_plane)) continue;
                face_[other] = face;
                stack.push_back(other);
            }
        }
    }

    std::vector<std::vector<int>> trace() const {
        // The border of each face, and at how many faces' borders a vertex is: at two it lies inside an edge and is no corner.
        std::vector<std::unordered_map<int, int>> next(face_count_);
        std::unordered_map<int, int> degree;
        for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
            for (int k = 0; k < 3; ++k) {
                const int u = triangles_[t][k];
                if (face_[across(t, k)] == face_[t]) continue;
                if (!next[face_[t]].emplace(u, triangles_[t][(k + 1) % 3]).second) return {};
                ++degree[u];
            }

        std::vector<std::vector<int>> loops;
        for (const auto& border : next) {
            if (border.empty()) return {};
            std::vector<int> loop;
            const int start = border.begin()->first;
            std::size_t steps = 0;
            int u = start;
            do {
                if (degree.at(u) >= 3) loop.push_back(u);
                u = border.at(u);
            } while (u != start && ++steps < border.size());
            if (steps + 1 != border.size() || loop.size() < 3) return {};
            std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
            loops.push_back(std::move(loop));
        }
        std::sort(loops.begin(), loops.end());
        return loops;
    }

    const std::vector<Vec3>& points_;
    const std::vector<Triangle>& triangles_;
    std::unordered_map<std::uint64_t, int> owner_;
    std::vector<int> face_;  // size of triangles_
    int face_count_ = 0;
};

// Refuses hulls whose vertices all lie near the plane of their largest triangle.
void check_thickness(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
    if (triangles.empty()) throw_flat(0, 1);
    Vec3 n = Vec3::Zero();
    const Vec3* origin = nullptr;
    for (const Triangle& t : triangles) {
        const Vec3 a = area_vector(points, t);
        if (!origin || a.squaredNorm() > n.squaredNorm()) n = a, origin = &points[t[0]];
    }
    n.normalize();
    Real thickness = 0;
    for (const Triangle& t : triangles)
        for (const int i : t) thickness = std::max(thickness, n.dot(*origin - points[i]));
    if (!(thickness > kFlat)) throw_flat(thickness, 1);
}

// Loops of indices into `all`.
std::vector<std::vector<int>> hull_loops(const std::vector<Vec3>& all) {
    const std::vector<Vec3> points = normalized_points(all);
    std::vector<Triangle> triangles = qhull_triangles(points);
    check_thickness(points, triangles);

    // Once more over the vertices alone, without near duplicates.
    const std::vector<int> kept = welded_vertices(points, triangles);
    std::vector<Vec3> corners(kept.size());
    for (std::size_t i = 0; i < kept.size(); ++i) corners[i] = points[kept[i]];
    triangles = corners.size() < 4 ? std::vector<Triangle>{} : qhull_triangles(corners);
    check_thickness(corners, triangles);

    for (const Real tolerance : {kMergeTolerance, kFinestTolerance}) {
        std::vector<std::vector<int>> loops = FaceMerger(corners, triangles).loops(tolerance);
        if (loops.size() < 4) continue;
        for (std::vector<int>& loop : loops)
            for (int& i : loop) i = kept[i];
        return loops;
    }
    throw Error("convex hull: the " + std::to_string(all.size()) + " points are too nearly degenerate to tell faces apart");
}

}  // namespace

ConvexHull::ConvexHull(const std::vector<Vec3>& points) {
    check_points(points);
    std::vector<std::vector<int>> loops = hull_loops(points);

    // Only the corners stay, in the order they came.
    std::vector<int> new_index(points.size(), -1);
    for (const std::vector<int>& loop : loops)
        for (const int i : loop) new_index[i] = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (new_index[i] < 0) continue;
        new_index[i] = static_cast<int>(vertices_.size());
        vertices_.push_back(points[i]);
    }
    coordinates_ = paired(vertices_);

    for (const std::vector<int>& loop : loops) {
        Face face;
        face.first = static_cast<int>(loop_.size());
        face.count = static_cast<int>(loop.size());
        for (const int i : loop) loop_.push_back(new_index[i]);
        // Newell's normal, taken about a vertex so that axis-aligned faces get exact normals.
        Vec3 area = Vec3::Zero();
        for (int k = 1; k + 1 < face.count; ++k) area += area_vector(points, {loop[0], loop[k], loop[k + 1]});
        face.normal = area.normalized();
        face.offset = face.normal.dot(vertices_[support(face.normal)]);
        faces_.push_back(face);
    }

    std::vector<Vec3> normals;
    for (const Face& f : faces_) normals.push_back(f.normal);
    normals_ = paired(normals);
    find_neighbours();
    centroid_ = volume_properties(*this).centroid;
    inner_radius_ = faces_[0].offset - faces_[0].normal.dot(centroid_);
    for (const Face& face : faces_) inner_radius_ = std::min(inner_radius_, face.offset - face.normal.dot(centroid_));
    for (const Vec3& v : vertices_) outer_radius_ = std::max(outer_radius_, v.norm());
}

// Each edge is in two loops, once in either direction.
void ConvexHull::find_neighbours() {
    neighbour_begin_.assign(vertices_.size() + 1, 0);
    for (const int i : loop_) ++neighbour_begin_[i + 1];
    for (std::size_t i = 0; i < vertices_.size(); ++i) neighbour_begin_[i + 1] += neighbour_begin_[i];
    neighbours_.resize(loop_.size());
    faces_of_.resize(loop_.size());
    std::vector<int> fill = neighbour_begin_;
    for (int f = 0; f < static_cast<int>(faces_.size()); ++f) {
        const Face& face = faces_[f];
        for (int k = 0; k < face.count; ++k) {
            const int place = fill[loop_[face.first + k]]++;
            neighbours_[place] = loop_[face.first + (k + 1 == face.count ? 0 : k + 1)];
            faces_of_[place] = f;
        }
    }
}

int ConvexHull::support(const Vec3& d) const {
    return farthest_of(coordinates_, static_cast<int>(vertices_.size()), d);
}

int ConvexHull::face_along(const Vec3& d) const {
    return farthest_of(normals_, static_cast<int>(faces_.size()), d);
}

Real ConvexHull::extent(const Vec3& d) const {
    const Real* c = coordinates_.data();
    const Pair x = {d.x(), d.x()}, y = {d.y(), d.y()}, z = {d.z(), d.z()};
    Pair most = (x * load(c) + y * load(c + 2)) + z * load(c + 4);
    for (const Real* const end = c + coordinates_.size(); (c += 6) != end;) {
        const Pair along = (x * load(c) + y * load(c + 2)) + z * load(c + 4);
        most = along > most ? along : most;
    }
    return most[0] > most[1] ? most[0] : most[1];
}

Aabb ConvexHull::bounds(const Mat3& R) const {
    Aabb box;
    for (int k = 0; k < 3; ++k) {
        const Real* c = coordinates_.data();
        const Pair x = {R(k, 0), R(k, 0)}, y = {R(k, 1), R(k, 1)}, z = {R(k, 2), R(k, 2)};
        Pair least = (x * load(c) + y * load(c + 2)) + z * load(c + 4), most = least;
        for (const Real* const end = c + coordinates_.size(); (c += 6) != end;) {
            const Pair along = (x * load(c) + y * load(c + 2)) + z * load(c + 4);
            least = along < least ? along : least;
            most = along > most ? along : most;
        }
        box.lo[k] = least[0] < least[1] ? least[0] : least[1];
        box.hi[k] = most[0] > most[1] ? most[0] : most[1];
    }
    return box;
}

}  // namespace cairn
