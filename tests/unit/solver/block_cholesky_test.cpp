// The block-sparse factorisation solves what dense algebra solves.
#include "solver/block_cholesky.hpp"
#include "tests/support/catch.hpp"

#include <Eigen/LU>

#include <random>

using namespace cairn;

namespace {

struct Problem {
    int n = 0;
    std::vector<std::pair<int, int>> pairs;
    std::vector<Mat6> diagonal, off;
    Eigen::MatrixXd dense;
};

// Positive definite: each pair adds J Jᵀ of a random J over both bodies, each body a multiple of the identity.
Problem random_problem(int n, int pairs, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<Real> value(-1, 1);
    std::uniform_int_distribution<int> body(0, n - 1);
    Problem p;
    p.n = n;
    p.diagonal.assign(static_cast<std::size_t>(n), Mat6(0.5 * Mat6::Identity()));
    for (int k = 0; k < pairs; ++k) {
        const int i = body(random), j = body(random);
        if (i == j) continue;
        Mat6 J_i, J_j;
        for (int e = 0; e < 36; ++e) {
            J_i(e) = value(random);
            J_j(e) = value(random);
        }
        p.pairs.emplace_back(i, j);
        p.diagonal[i] += J_i * J_i.transpose();
        p.diagonal[j] += J_j * J_j.transpose();
        p.off.push_back(J_i * J_j.transpose());
    }
    p.dense = Eigen::MatrixXd::Zero(6 * n, 6 * n);
    for (int i = 0; i < n; ++i) p.dense.block<6, 6>(6 * i, 6 * i) = p.diagonal[i];
    for (std::size_t k = 0; k < p.pairs.size(); ++k) {
        const auto [i, j] = p.pairs[k];
        p.dense.block<6, 6>(6 * i, 6 * j) += p.off[k];
        p.dense.block<6, 6>(6 * j, 6 * i) += p.off[k].transpose();
    }
    return p;
}

void fill(BlockCholesky& factor, const Problem& p) {
    factor.set_zero();
    for (int i = 0; i < p.n; ++i) factor.add_diagonal(i, p.diagonal[i]);
    for (std::size_t k = 0; k < p.pairs.size(); ++k) factor.add_pair(static_cast<int>(k), p.off[k]);
}

}  // namespace

TEST_CASE("a block-sparse factorisation solves as dense algebra does") {
    // Graphs without pairs, trees, with loops and with a pair given more than once (the last has more pairs than pairs of bodies).
    const int sizes[][2] = {{1, 0}, {3, 0}, {2, 1}, {12, 11}, {20, 45}, {5, 60}, {60, 200}};
    for (const auto& [n, pairs] : sizes) {
        const Problem p = random_problem(n, pairs, static_cast<unsigned>(n + pairs));
        BlockCholesky factor;
        factor.analyse(p.n, p.pairs);
        fill(factor, p);
        REQUIRE(factor.factorise());
        std::vector<Vec6> x(static_cast<std::size_t>(n));
        Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(6 * n, -1, 2);
        for (int i = 0; i < n; ++i) x[i] = b.segment<6>(6 * i);
        factor.solve(x);
        const Eigen::VectorXd wanted = p.dense.partialPivLu().solve(b);
        CAPTURE(n, pairs);
        // The matrices' condition numbers are below 1e4: 1e-16 × 1e4, with room.
        for (int i = 0; i < n; ++i) CHECK((x[i] - wanted.segment<6>(6 * i)).norm() <= 1e-11 * (1 + wanted.norm()));
    }
}

TEST_CASE("a matrix that is not positive definite is refused, and the next one is not") {
    const Problem p = random_problem(6, 9, 7);
    BlockCholesky factor;
    factor.analyse(p.n, p.pairs);
    fill(factor, p);
    factor.add_diagonal(3, Mat6(-1e3 * Mat6::Identity()));
    CHECK_FALSE(factor.factorise());
    fill(factor, p);
    CHECK(factor.factorise());
}
