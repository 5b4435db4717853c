#include "collision/mesh.hpp"

#include "engine/base/error.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"

#include <limits>
#include <random>
#include <string>

using namespace cairn;

namespace {

// (n + 1)² vertices over [0, n]², two triangles a cell: 2c below and 2c + 1 above the diagonal, normals up.
struct Grid {
    std::vector<Vec3> vertices;
    std::vector<std::array<int, 3>> triangles;
};

Grid grid(int n) {
    Grid g;
    for (int y = 0; y <= n; ++y)
        for (int x = 0; x <= n; ++x) g.vertices.push_back(Vec3(x, y, 0));
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            const int i = y * (n + 1) + x;
            g.triangles.push_back({i, i + 1, i + n + 2});
            g.triangles.push_back({i, i + n + 2, i + n + 1});
        }
    return g;
}

// The same triangles, each with three vertices of its own.
Grid unshared(const Grid& g) {
    Grid out;
    for (const auto& t : g.triangles) {
        const int i = static_cast<int>(out.vertices.size());
        for (const int k : t) out.vertices.push_back(g.vertices[k]);
        out.triangles.push_back({i, i + 1, i + 2});
    }
    return out;
}

Grid random_soup(int count, std::mt19937& random) {
    std::uniform_real_distribution<Real> uniform(-1, 1);
    const auto point = [&](Real size) {
        const Real x = uniform(random), y = uniform(random), z = uniform(random);
        return Vec3(size * Vec3(x, y, z));
    };
    Grid g;
    for (int i = 0; i < count; ++i) {
        // Sizes over three decades, so that the tree is uneven.
        const Vec3 centre = point(10);
        const Real size = std::pow(10.0, uniform(random) * 1.5 - 0.5);
        for (int k = 0; k < 3; ++k) g.vertices.push_back(centre + point(size));
        g.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return g;
}

std::vector<int> brute_force(const TriangleMesh& mesh, const Aabb& box) {
    std::vector<int> found;
    for (int t = 0; t < static_cast<int>(mesh.triangles().size()); ++t) {
        const auto& v = mesh.triangles()[t];
        Aabb b{mesh.vertices()[v[0]], mesh.vertices()[v[0]]};
        for (const int i : v) b = b.merged({mesh.vertices()[i], mesh.vertices()[i]});
        if (b.overlaps(box)) found.push_back(t);
    }
    return found;
}

std::string error_of(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& triangles) {
    try {
        TriangleMesh mesh(vertices, triangles);
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

}  // namespace

TEST_CASE("a mesh query finds what brute force finds, in ascending order, and appends it") {
    const int count = GENERATE(1, 4, 5, 37, 3000);
    CAPTURE(count);
    std::mt19937 random(count);
    const Grid soup = random_soup(count, random);
    const TriangleMesh mesh(soup.vertices, soup.triangles);
    std::uniform_real_distribution<Real> uniform(-1, 1);
    std::size_t total = 0;
    for (int i = 0; i < 200; ++i) {
        const Real x = uniform(random), y = uniform(random), z = uniform(random), half = 1 + uniform(random);
        const Aabb box = Aabb{12 * Vec3(x, y, z), 12 * Vec3(x, y, z)}.grown(half);
        std::vector<int> found{-7};
        mesh.query(box, found);
        REQUIRE(found.front() == -7);
        found.erase(found.begin());
        REQUIRE(found == brute_force(mesh, box));
        total += found.size();
    }
    if (count == 3000) CHECK(total > 1000);
    std::vector<int> all;
    mesh.query(mesh.bounds(), all);
    CHECK(static_cast<int>(all.size()) == count);
}

TEST_CASE("a mesh query leaves out what is said to be missed, and nothing else") {
    using Leaf = MeshTree::Leaf;
    std::mt19937 random(5);
    const Grid soup = random_soup(500, random);
    const TriangleMesh mesh(soup.vertices, soup.triangles);
    const auto is_high = [](const Leaf& leaf) { return leaf.lo[2] > 1.0F; };
    std::vector<int> all, low, expected;
    mesh.query(mesh.bounds(), all);
    mesh.query(mesh.bounds(), is_high, low);
    for (const int t : all) {
        const TriangleMesh::Triangle& record = mesh.triangle(t);
        for (int k = 0; k < 3; ++k) {
            REQUIRE(record.vertex[k] == mesh.triangles()[t][k]);
            REQUIRE(record.corner[k] == mesh.vertices()[record.vertex[k]]);
        }
        const Real bottom = std::min({record.corner[0].z(), record.corner[1].z(), record.corner[2].z()});
        if (bottom < 1 + 1e-6) expected.push_back(t);  // boxes are kept in single precision, rounded outwards
    }
    CHECK(low == expected);
    CHECK(low.size() < all.size());
}

TEST_CASE("triangles that all lie at one place do not make the tree too deep") {
    Grid g;
    for (int i = 0; i < 1000; ++i) {
        g.vertices.insert(g.vertices.end(), {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)});
        g.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    // And a run of triangles, each a tenth of the one before, which a split by area peels off one by one.
    for (int i = 0; i < 70; ++i) {
        const Real s = std::pow(10.0, -i);
        const int first = static_cast<int>(g.vertices.size());
        g.vertices.insert(g.vertices.end(), {Vec3(s, 0, 0), Vec3(2 * s, 0, 0), Vec3(s, s, 0)});
        g.triangles.push_back({first, first + 1, first + 2});
    }
    const TriangleMesh mesh(g.vertices, g.triangles);
    std::vector<int> found;
    mesh.query(mesh.bounds(), found);
    CHECK(found.size() == 1070);
}

TEST_CASE("the neighbours in a grid are the triangles across its edges, shared vertices or not") {
    const bool share = GENERATE(true, false);
    CAPTURE(share);
    const int n = 5;
    const Grid g = share ? grid(n) : unshared(grid(n));
    const TriangleMesh mesh(g.vertices, g.triangles);
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            const int below = 2 * (y * n + x), above = below + 1;
            CHECK(mesh.neighbour(below, 0) == (y > 0 ? below - 2 * n + 1 : -1));
            CHECK(mesh.neighbour(below, 1) == (x + 1 < n ? below + 3 : -1));
            CHECK(mesh.neighbour(below, 2) == above);
            CHECK(mesh.neighbour(above, 0) == below);
            CHECK(mesh.neighbour(above, 1) == (y + 1 < n ? above + 2 * n - 1 : -1));
            CHECK(mesh.neighbour(above, 2) == (x > 0 ? above - 3 : -1));
            CHECK(mesh.normal(below) == Vec3::UnitZ());
        }
    CHECK(mesh.bounds().lo == Vec3::Zero());
    CHECK(mesh.bounds().hi == Vec3(n, n, 0));
}

TEST_CASE("a mesh knows how it bends across each edge") {
    using Bend = TriangleMesh::Bend;
    // Two triangles that share the edge from 0 to 1, the second one's far corner `drop` below the plane of the first.
    const auto bend = [](Real drop) {
        const TriangleMesh mesh({{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, -drop}}, {{0, 1, 2}, {1, 0, 3}});
        CHECK(mesh.bend(0, 1) == Bend::kRidge);  // a border
        CHECK(mesh.bend(0, 0) == mesh.bend(1, 0));
        return mesh.bend(0, 0);
    };
    CHECK(bend(0) == Bend::kNone);
    CHECK(bend(1e-6) == Bend::kNone);
    CHECK(bend(1e-3) == Bend::kHollow);  // as good as flat: no edge to what slides over it
    CHECK(bend(-0.1) == Bend::kHollow);
    CHECK(bend(3e-3) == Bend::kRidge);
    CHECK(bend(20) == Bend::kRidge);
}

TEST_CASE("a triangle wound the other way is no neighbour") {
    const TriangleMesh mesh({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0)}, {{0, 1, 2}, {1, 2, 3}});
    for (int k = 0; k < 3; ++k) CHECK(mesh.neighbour(0, k) == -1);
}

TEST_CASE("a mesh query does not use the heap") {
    std::mt19937 random(1);
    const Grid soup = random_soup(500, random);
    const TriangleMesh mesh(soup.vertices, soup.triangles);
    std::vector<int> found;
    found.reserve(500);
    const std::uint64_t before = allocation_count::count();
    mesh.query(mesh.bounds(), found);
    const std::uint64_t after = allocation_count::count();
    CHECK(after == before);
    CHECK(found.size() == 500);
}

TEST_CASE("a bad mesh is refused by the name of what is wrong with it") {
    const std::vector<Vec3> vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(3, 0, 0)};
    CHECK(error_of(vertices, {{0, 1, 2}}).empty());
    CHECK(error_of(vertices, {}) == "mesh, number of triangles: 0, must be > 0");
    CHECK(error_of(vertices, {{0, 1, 2}, {0, 1, 4}}) == "mesh triangle 1, vertex index: 4, must be in [0, 4)");
    CHECK(error_of(vertices, {{0, -1, 2}}) == "mesh triangle 0, vertex index: -1, must be in [0, 4)");
    CHECK(error_of(vertices, {{0, 1, 3}}) == "mesh triangle 0, area: 0, must be > 0 (its vertices lie on a line)");
    std::vector<Vec3> infinite = vertices;
    infinite[2].z() = std::numeric_limits<Real>::infinity();
    CHECK(error_of(infinite, {{0, 1, 2}}) == "mesh vertex 2: inf, must be finite");
}
