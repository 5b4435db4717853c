// Cholesky factorisation of a symmetric positive definite matrix of 6 × 6 blocks, one block row a body: H = L Lᵀ.
//
// `analyse` orders the bodies (approximate minimum degree: Amestoy, Davis, Duff 1996, by Eigen) and finds where L has blocks
// (George and Liu 1981); `factorise` and `solve` do the numbers and allocate nothing. Left-looking by block columns.
#pragma once

#include "engine/base/math.hpp"

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

    // False if a pivot is not positive or not finite; H is lost then.
    bool factorise();

    // x ← H⁻¹ x; x has size n.
    void solve(std::vector<Vec6>& x) const;

private:
    using Block = Eigen::Map<Mat6>;
    using ConstBlock = Eigen::Map<const Mat6>;
    Block block(std::int64_t k) { return Block(values_.data() + 36 * k); }
    ConstBlock block(std::int64_t k) const { return ConstBlock(values_.data() + 36 * k); }
    void find_structure(const std::vector<std::vector<int>>& below);

    // A block of L left of the diagonal in some row: its column and its place.
    struct RowEntry {
        int column;
        int place;
    };

    int n_ = 0;
    std::int64_t products_ = 0;
    std::vector<int> order_;     // position → body
    std::vector<int> position_;  // body → position
    std::vector<int> start_;     // of column k in rows_, n + 1; its first block is the diagonal one
    std::vector<int> rows_;      // row of each block of L, ascending in a column
    std::vector<int> row_start_;
    std::vector<RowEntry> row_entries_;
    std::vector<int> diagonal_;  // body → place of its diagonal block
    std::vector<int> place_;     // pair → place of its block
    std::vector<char> transposed_;
    std::vector<Real> values_;  // 36 per block, column-major; of the diagonal blocks the inverse of L_kk after factorise
    std::vector<int> local_;    // row → place in the column that is being made
    mutable std::vector<Vec6> work_;
};

}  // namespace cairn
