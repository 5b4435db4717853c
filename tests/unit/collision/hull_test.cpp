#include "collision/hull.hpp"

#include "engine/base/error.hpp"
#include "tests/support/catch.hpp"

#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>

using namespace cairn;

namespace {

std::vector<Vec3> cube_points(Real h) {
    std::vector<Vec3> points;
    for (const Real x : {-h, h})
        for (const Real y : {-h, h})
            for (const Real z : {-h, h}) points.push_back(Vec3(x, y, z));
    return points;
}

std::vector<Vec3> random_points(int count, std::mt19937& random) {
    std::uniform_real_distribution<Real> uniform(-1, 1);
    std::vector<Vec3> points;
    for (int i = 0; i < count; ++i) points.push_back(Vec3(uniform(random), 0.7 * uniform(random), 1.4 * uniform(random)));
    return points;
}

Quat random_rotation(std::mt19937& random) {
    std::normal_distribution<Real> normal;
    return Quat(normal(random), normal(random), normal(random), normal(random)).normalized();
}

// How often each directed edge is walked by the faces' loops.
std::map<std::pair<int, int>, int> directed_edges(const ConvexHull& hull) {
    std::map<std::pair<int, int>, int> edges;
    for (const ConvexHull::Face& face : hull.faces())
        for (int k = 0; k < face.count; ++k) ++edges[{hull.loop()[face.first + k], hull.loop()[face.first + (k + 1) % face.count]}];
    return edges;
}

// Laws of every hull: V − E + F = 2 with each edge shared by two faces, convex loops counter-clockwise from outside, loop vertices on the
// face and all others behind it. `flatness`: how far a loop vertex may be from its face [m].
void check_laws(const ConvexHull& hull, Real flatness) {
    const std::map<std::pair<int, int>, int> edges = directed_edges(hull);
    for (const auto& [edge, times] : edges) {
        CHECK(times == 1);
        CHECK(edges.count({edge.second, edge.first}) == 1);
    }
    CHECK(static_cast<int>(hull.vertices().size()) - static_cast<int>(edges.size()) / 2 + static_cast<int>(hull.faces().size()) == 2);

    int bent = 0, behind = 0, off_plane = 0;
    for (const ConvexHull::Face& face : hull.faces()) {
        CHECK(std::abs(face.normal.norm() - 1) < 1e-15);
        CHECK(face.normal.dot(hull.centroid()) < face.offset);
        for (int k = 0; k < face.count; ++k) {
            const Vec3& a = hull.vertices()[hull.loop()[face.first + k]];
            const Vec3& b = hull.vertices()[hull.loop()[face.first + (k + 1) % face.count]];
            const Vec3& c = hull.vertices()[hull.loop()[face.first + (k + 2) % face.count]];
            bent += face.normal.dot((b - a).cross(c - b)) <= 0;
            off_plane += std::abs(face.normal.dot(a) - face.offset) > flatness;
        }
        for (const Vec3& v : hull.vertices()) behind += face.normal.dot(v) > face.offset;
    }
    CHECK(bent == 0);
    CHECK(behind == 0);
    CHECK(off_plane == 0);
}

std::string error_of(const std::vector<Vec3>& points) {
    try {
        ConvexHull hull(points);
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

}  // namespace

TEST_CASE("the hull of random points holds them all and obeys Euler's formula") {
    const unsigned seed = GENERATE(1u, 2u, 3u, 4u, 5u);
    const int count = GENERATE(4, 10, 100, 2000);
    CAPTURE(seed, count);
    std::mt19937 random(seed);
    const std::vector<Vec3> points = random_points(count, random);
    const ConvexHull hull(points);
    check_laws(hull, 1e-15);

    // Offsets are exact to a few rounding errors of numbers of size 1.4.
    Real worst = -1;
    for (const ConvexHull::Face& face : hull.faces())
        for (const Vec3& p : points) worst = std::max(worst, face.normal.dot(p) - face.offset);
    CHECK(worst < 1e-12);
}

TEST_CASE("a cube keeps 8 vertices and 6 exact faces of 4, whatever points lie on its faces, edges and inside, at any scale") {
    const Real h = GENERATE(0.5e-3, 0.05, 1.0, 500.0);
    CAPTURE(h);
    std::vector<Vec3> points = {Vec3(0, 0, 0),        Vec3(h, 0, 0),  Vec3(h, 0.3 * h, -0.2 * h), Vec3(0.1 * h, h, 0.7 * h),
                                Vec3(h, h, 0.25 * h), Vec3(-h, 0, -h)};
    for (const Vec3& p : cube_points(h)) points.insert(points.end(), 2, p);
    const ConvexHull hull(points);

    check_laws(hull, 0);
    CHECK(hull.vertices().size() == 8);
    REQUIRE(hull.faces().size() == 6);
    for (const ConvexHull::Face& face : hull.faces()) {
        CHECK(face.count == 4);
        CHECK(face.normal.cwiseAbs().sum() == 1);
        CHECK(face.offset == h);
    }
    CHECK(hull.centroid().norm() < 1e-15 * h);
    CHECK(hull.inner_radius() == Approx(h).epsilon(1e-15));
    CHECK(hull.outer_radius() == Approx(std::sqrt(3.0) * h).epsilon(1e-15));
}

TEST_CASE("a turned and shifted cube with points on its faces still has 6 faces of 4") {
    const unsigned seed = GENERATE(range(1u, 21u));
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<Real> uniform(-1, 1);
    std::vector<Vec3> points = cube_points(1);
    for (int i = 0; i < 60; ++i) {
        Vec3 p(uniform(random), uniform(random), uniform(random));
        p[i % 3] = i % 2 ? 1 : -1;
        if (i < 20) p[(i + 1) % 3] = 1;
        points.push_back(p);
    }
    const Quat q = random_rotation(random);
    const Vec3 shift = 10 * Vec3(uniform(random), uniform(random), uniform(random));
    for (Vec3& p : points) p = q * p + shift;
    const ConvexHull hull(points);
    // Coordinates up to 18 are rounded to 2e-15; a loop vertex is off the plane by a few of that.
    check_laws(hull, 2e-14);
    CHECK(hull.vertices().size() == 8);
    CHECK(hull.faces().size() == 6);
    CHECK((hull.centroid() - shift).norm() < 2e-14);
    CHECK(std::abs(hull.inner_radius() - 1) < 2e-14);
}

// As from a file that rounds: points of a lattice on a cube, each coordinate off by up to 1e-9, so hundreds of them stick out a little.
TEST_CASE("a lattice of points on a cube that are slightly off still makes 6 faces of 4") {
    const unsigned seed = GENERATE(range(1u, 11u));
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<Real> noise(-1e-9, 1e-9);
    std::vector<Vec3> points;
    for (int i = 0; i < 343; ++i) {
        const Real x = noise(random), y = noise(random), z = noise(random);
        points.push_back(Vec3(i % 7 - 3, i / 7 % 7 - 3, i / 49 - 3) / 3 + Vec3(x, y, z));
    }
    const ConvexHull hull(points);
    check_laws(hull, 1e-8);
    CHECK(hull.vertices().size() == 8);
    CHECK(hull.faces().size() == 6);
}

TEST_CASE("a drum of 64 sides has two caps of 64 corners and 64 sides of 4") {
    std::vector<Vec3> points;
    for (int i = 0; i < 64; ++i)
        for (const Real z : {-0.3, 0.3}) points.push_back(Vec3(std::cos(i * kPi / 32), std::sin(i * kPi / 32), z));
    const ConvexHull hull(points);
    check_laws(hull, 1e-15);
    CHECK(hull.vertices().size() == 128);
    REQUIRE(hull.faces().size() == 66);
    int caps = 0;
    for (const ConvexHull::Face& face : hull.faces()) caps += face.count == 64;
    CHECK(caps == 2);
}

TEST_CASE("the support vertex is the first of the farthest along any direction, and so is the face along it") {
    std::mt19937 random(7);
    const bool on_a_ball = GENERATE(false, true);
    std::vector<Vec3> points = random_points(300, random);
    if (on_a_ball)
        for (Vec3& p : points) p.normalize();
    const ConvexHull hull(points);
    CHECK((hull.vertices().size() > 128) == on_a_ball);
    const auto first_of_farthest = [](const auto& list, const Vec3& d, auto vector_of) {
        int best = 0;
        for (int i = 1; i < static_cast<int>(list.size()); ++i)
            if (d.dot(vector_of(list[i])) > d.dot(vector_of(list[best]))) best = i;
        return best;
    };
    for (int i = 0; i < 200; ++i) {
        const Vec3 d = random_rotation(random) * Vec3::UnitX() * std::pow(10.0, i % 7 - 3);
        CHECK(hull.support(d) == first_of_farthest(hull.vertices(), d, [](const Vec3& v) { return v; }));
        CHECK(hull.face_along(d) == first_of_farthest(hull.faces(), d, [](const ConvexHull::Face& f) { return f.normal; }));
        CHECK(hull.extent(d) == hull.vertices()[hull.support(d)].dot(d));
    }
}

TEST_CASE("a vertex's neighbours are those it shares an edge with, and the second farthest vertex is one of the farthest one's") {
    std::mt19937 random(12);
    for (int round = 0; round < 50; ++round) {
        const ConvexHull hull(random_points(30, random));
        const auto edges = directed_edges(hull);
        std::size_t found = 0;
        for (int i = 0; i < static_cast<int>(hull.vertices().size()); ++i)
            for (const int k : hull.neighbours(i)) {
                CHECK(edges.count({i, k}) == 1);
                ++found;
            }
        CHECK(found == edges.size());
        const Vec3 d = random_rotation(random) * Vec3::UnitX();
        const int best = hull.support(d);
        Real second = -std::numeric_limits<Real>::infinity(), beside = second;
        for (int i = 0; i < static_cast<int>(hull.vertices().size()); ++i)
            if (i != best) second = std::max(second, d.dot(hull.vertices()[i]));
        for (const int k : hull.neighbours(best)) beside = std::max(beside, d.dot(hull.vertices()[k]));
        CHECK(beside == second);
    }
}

TEST_CASE("the same points give the same hull, and vertices keep the order they came in") {
    std::mt19937 random(3);
    const std::vector<Vec3> points = random_points(500, random);
    const ConvexHull a(points), b(points);
    CHECK(a.vertices() == b.vertices());
    CHECK(a.loop() == b.loop());
    std::size_t at = 0;
    for (const Vec3& p : points)
        if (at < a.vertices().size() && p == a.vertices()[at]) ++at;
    CHECK(at == a.vertices().size());
}

TEST_CASE("points that enclose no volume are refused") {
    CHECK(error_of({}) == "convex hull, number of points: 0, must be >= 4");
    CHECK(error_of({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}) == "convex hull, number of points: 3, must be >= 4");

    std::vector<Vec3> points = cube_points(1);
    points[5].y() = std::numeric_limits<Real>::infinity();
    CHECK(error_of(points) == "convex hull point 5: inf, must be finite");

    for (const Real scale : {1e-3, 1.0, 1e3}) {
        const auto flattened = [&](Real x, Real y, Real z) {
            std::vector<Vec3> flat = cube_points(scale);
            for (Vec3& p : flat) p = p.cwiseProduct(Vec3(x, y, z)) + Vec3(0.1, 0.2, 0.3) * scale;
            return error_of(flat);
        };
        CHECK(flattened(1, 1, 1).empty());
        CHECK(flattened(1, 1, 1e-5).empty());
        CHECK(flattened(1, 1, 1e-7).find("enclose no volume") != std::string::npos);
        CHECK(flattened(1, 1, 0).find("enclose no volume") != std::string::npos);
        CHECK(flattened(1, 0, 0).find("enclose no volume") != std::string::npos);
        CHECK(flattened(0, 0, 0).find("enclose no volume") != std::string::npos);
    }
}
