// Cholesky factorisation of a symmetric positive definite matrix of 6 × 6 blocks, one block row a body: H = L Lᵀ.
//
// `analyse` orders the bodies (approximate minimum degree: Amestoy, Davis, Duff 1996, by Eigen) and finds where L has blocks
// (George and Liu 1981); `factorise` and `solve` do the numbers and allocate nothing. Left-looking, by supernodes: neighbouring columns
// with the same rows below them (Ng and Peyton 1993), which take what comes from an earlier column while that is at hand.
#pragma once

#include "engine/base/math.hpp"
#include "engine/base/team.hpp"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace cairn {

using Mat6 = Eigen::Matrix<Real, 6, 6>;
using Vec6 = Eigen::Matrix<Real, 6, 1>;

class BlockCholesky {
public:
    // The pattern: n block rows, and the pairs (i, j), i != j, off the diagonal that may be nonzero. Pairs may repeat. Allocates.
    void analyse(int n, const std::vector<std::pair<int, int>>& pairs);

    int size() const { return n_; }
    // Block products of a factorisation: what it costs, some 432 flops each.
    std::int64_t products() const { return products_; }
    // Blocks of L; a solve reads each of them twice.
    std::int64_t blocks() const { return static_cast<std::int64_t>(rows_.size()); }

    // H is set before each factorisation: zero, then add. `pair` is an index into `pairs`; H_ij is the block of its (i, j).
    void set_zero();
    void add_diagonal(int i, const Mat6& H_ii) { block(diagonal_[i]) += H_ii; }
    void add_pair(int pair, const Mat6& H_ij) {
        if (transposed_[pair]) {
            block(place_[pair]) += H_ij.transpose();
        } else {
            block(place_[pair]) += H_ij;
        }
    }

    // Of H before `factorise`, of L after it.
    const std::vector<Real>& values() const { return values_; }

    // False if a pivot is not positive or not finite; H is lost then. With a team, columns are shared out by rows: the result is the same.
    bool factorise(Team* team = nullptr);

    // x ← H⁻¹ x; x has size n. `worker`: that of a team, where several solve side by side, each an x of its own; below kMostWorkers.
    void solve(std::vector<Vec6>& x, int worker = 0) const;
    static constexpr int kMostWorkers = 16;

private:
    using Block = Eigen::Map<Mat6>;
    using ConstBlock = Eigen::Map<const Mat6>;
    Block block(std::int64_t k) { return Block(values_.data() + 36 * k); }
    ConstBlock block(std::int64_t k) const { return ConstBlock(values_.data() + 36 * k); }
    void find_structure(const std::vector<std::vector<int>>& below);
    void find_supernodes();
    void take_from_before(int supernode, int begin, int end);
    bool finish_columns(int supernode);

    // Blocks of L left of a supernode in its rows: their column, the first one's place, and how many there are.
    struct RowEntry {
        int column;
        int place;
        int count;
    };

    int n_ = 0;
    std::int64_t products_ = 0;
    std::vector<int> order_;      // position → body
    std::vector<int> position_;   // body → position
    std::vector<int> start_;      // of column k in rows_, n + 1; its first block is the diagonal one
    std::vector<int> rows_;       // row of each block of L, ascending in a column
    std::vector<int> supernode_;  // first column of each, and n
    std::vector<int> entry_start_;
    std::vector<RowEntry> entries_;    // of each supernode, by column
    std::vector<std::int64_t> taken_;  // products of each supernode with earlier columns
    std::vector<int> diagonal_;        // body → place of its diagonal block
    std::vector<int> place_;           // pair → place of its block
    std::vector<char> transposed_;
    std::vector<Real> values_;  // 36 per block, column-major; of the diagonal blocks the inverse of L_kk after factorise
    std::vector<int> local_;    // row → its number among those of the supernode that is being made
    mutable std::array<std::vector<Vec6>, kMostWorkers> work_;  // by worker
};

}  // namespace cairn
