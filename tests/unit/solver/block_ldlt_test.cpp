// Block-sparse LDLᵀ against dense algebra.
#include "solver/block_ldlt.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/solver/solver_support.hpp"

#include <Eigen/Dense>

using namespace cairn;
using namespace cairn::solver_test;

namespace {

using Dense = Eigen::MatrixXd;

struct Graph {
    std::vector<int> sizes;
    std::vector<std::pair<int, int>> edges;
};

// J Jᵀ of one random row block per node and an unknown per edge and node: as G M⁻¹ Gᵀ is made. Rows in the caller's order.
Dense random_matrix(Random& random, const Graph& g, const std::vector<int>& first, int rows) {
    const int unknowns = 6 * static_cast<int>(g.edges.size() + g.sizes.size());
    Dense J = Dense::Zero(rows, unknowns);
    const auto fill = [&](int block, int column) {
        for (int r = 0; r < g.sizes[block]; ++r)
            for (int c = 0; c < 6; ++c) J(first[block] + r, column + c) = uniform(random, -1, 1);
    };
    int column = 0;
    for (const auto& [a, b] : g.edges) {
        fill(a, column);
        fill(b, column);
        column += 6;
    }
    for (std::size_t i = 0; i < g.sizes.size(); ++i, column += 6) fill(static_cast<int>(i), column);
    return J * J.transpose();
}

// A in the pattern's own order of rows.
std::vector<int> rows_in_order(const BlockPattern& p) {
    std::vector<int> first(p.count());
    for (int i = 0; i < p.count(); ++i) first[i] = p.first_row(i);
    return first;
}

void put(const Dense& A, const Graph& g, const BlockPattern& p, BlockLdlt& ldlt) {
    ldlt.begin(p);
    const auto copy = [&](int a, int b, int offset) {
        for (int r = 0; r < g.sizes[a]; ++r)
            for (int c = 0; c < g.sizes[b]; ++c) ldlt.values(offset)[r * g.sizes[b] + c] = A(p.first_row(a) + r, p.first_row(b) + c);
    };
    for (int i = 0; i < p.count(); ++i) copy(i, i, p.diagonal(i));
    for (const auto& [a, b] : g.edges) {
        const BlockPlace place = p.off_diagonal(a, b);
        copy(place.swapped ? b : a, place.swapped ? a : b, place.offset);
    }
}

Graph random_graph(Random& random, int nodes, int extra_edges) {
    Graph g;
    for (int i = 0; i < nodes; ++i) {
        g.sizes.push_back(1 + static_cast<int>(random() % 6));
        if (i > 0) g.edges.push_back({i, static_cast<int>(random() % i)});
    }
    for (int k = 0; k < extra_edges; ++k) {
        const int a = static_cast<int>(random() % nodes), b = static_cast<int>(random() % nodes);
        if (a != b) g.edges.push_back({a, b});
    }
    return g;
}

}  // namespace

TEST_CASE("block LDLᵀ solves random sparse systems of blocks of one to six rows as dense algebra does") {
    Random random(5);
    for (int k = 0; k < 60; ++k) {
        const Graph g = random_graph(random, 1 + k % 20, k % 3 == 0 ? 0 : k % 12);
        CAPTURE(k);
        BlockPattern p;
        p.analyse(g.sizes, g.edges);
        const Dense A = random_matrix(random, g, rows_in_order(p), p.rows());
        BlockLdlt ldlt;
        put(A, g, p, ldlt);
        REQUIRE(ldlt.factor(1e-12) == 0);
        const Eigen::VectorXd x = Eigen::VectorXd::Random(p.rows());
        Eigen::VectorXd b = A * x;
        ldlt.solve(b.data());
        // Backward stable: rounding times the condition, below 1e5 for these.
        CHECK((b - x).norm() < 1e-9 * x.norm());
    }
}

TEST_CASE("forward elimination along the way to the root gives Bᵀ A⁻¹ B of a block's columns") {
    Random random(11);
    for (int k = 0; k < 40; ++k) {
        const Graph g = random_graph(random, 2 + k % 15, k % 4);
        CAPTURE(k);
        BlockPattern p;
        p.analyse(g.sizes, g.edges);
        const Dense A = random_matrix(random, g, rows_in_order(p), p.rows());
        BlockLdlt ldlt;
        put(A, g, p, ldlt);
        REQUIRE(ldlt.factor(1e-12) == 0);
        const int block = static_cast<int>(random() % g.sizes.size());
        std::vector<int> turns, offset(p.count(), -1);
        int rows = 0;
        for (int t = p.turn(block); t >= 0; t = p.parent(t)) {
            turns.push_back(t);
            offset[t] = rows;
            rows += p.turn_size(t);
        }
        std::vector<Real> Y(6 * rows, 0), Z(6 * rows, 0);
        Dense B = Dense::Zero(p.rows(), 6);
        for (int r = 0; r < g.sizes[block]; ++r)
            for (int c = 0; c < 6; ++c) B(p.first_row(block) + r, c) = Y[6 * r + c] = uniform(random, -1, 1);
        ldlt.forward(turns.data(), static_cast<int>(turns.size()), offset.data(), Y.data(), Z.data());
        const Eigen::Map<const Eigen::Matrix<Real, 6, Eigen::Dynamic>> Yt(Y.data(), 6, rows), Zt(Z.data(), 6, rows);
        const Dense truth = B.transpose() * A.ldlt().solve(B);
        CHECK((Yt * Zt.transpose() - truth).norm() < 1e-9 * truth.norm());  // as above
    }
}

TEST_CASE("a tree of blocks is eliminated without fill") {
    Random random(7);
    const Graph g = random_graph(random, 200, 0);
    BlockPattern p;
    p.analyse(g.sizes, g.edges);
    int entries = 0;
    for (int s : g.sizes) entries += s * s;
    for (const auto& [a, b] : g.edges) entries += g.sizes[a] * g.sizes[b];
    CHECK(p.value_count() == entries);
}

TEST_CASE("redundant rows are dropped and the others solved") {
    Random random(9);
    for (int k = 0; k < 40; ++k) {
        Graph g = random_graph(random, 6, 4);
        for (int& s : g.sizes) s = 3;
        CAPTURE(k);
        BlockPattern p;
        p.analyse(g.sizes, g.edges);
        // Two rows that are sums of others: A = J Jᵀ stays positive semidefinite.
        const Dense B = random_matrix(random, g, rows_in_order(p), p.rows());
        const int a = p.first_row(g.edges[0].first), b = p.first_row(g.edges[0].second);
        Dense T = Dense::Identity(p.rows(), p.rows());
        T.row(a + 1) = 2 * T.row(a);
        T.row(b + 2) = T.row(b) - T.row(b + 1);
        const Dense A = T * B * T.transpose();
        BlockLdlt ldlt;
        put(A, g, p, ldlt);
        REQUIRE(ldlt.factor(1e-11) == 2);
        // A right-hand side that the rows agree on, as consistent constraints do.
        const Eigen::VectorXd rhs = A * Eigen::VectorXd::Random(p.rows());
        Eigen::VectorXd x = rhs;
        ldlt.solve(x.data());
        CHECK((A * x - rhs).norm() < 1e-9 * rhs.norm());
        for (int r = 0; r < p.rows(); ++r)
            if (ldlt.is_dropped(r)) CHECK(x[r] == 0);
    }
}
