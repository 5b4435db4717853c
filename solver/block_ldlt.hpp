// Sparse LDLᵀ of a symmetric positive semidefinite matrix of small dense blocks.
//
//     A = L D Lᵀ      blocks of 1 to 6 rows, their sizes may differ; D block diagonal, L block unit lower triangular
//
// Blocks are eliminated in the order of least degree (Tinney and Walker 1967), ties by index: a tree from its leaves, without fill.
// The order and the pattern of L (the symbolic phase) depend on the graph alone; BlockPattern keeps them while the graph stays.
//
// Redundant rows: a pivot below `drop` times the diagonal that the row began with is not divided by. Its row and column leave the system,
// which is to solve the rows that are left, with 0 for the unknown of the row that went. For a matrix G M⁻¹ Gᵀ of consistent constraints
// what it asks is then met by the others.
//
// Unknowns and right-hand sides are laid out in the order of elimination: block i has rows [first_row(i), first_row(i) + size(i)).
// Uses: joints alone in an island (solver/rattle.hpp), or as the joint block inside a substep with contacts around it.
#pragma once

#include "engine/base/math.hpp"

#include <utility>
#include <vector>

namespace cairn {

constexpr int kMaxBlockRows = 6;

// Where the block of two nodes is: `offset` of its row-major entries among the values. Its rows are those of the node that is eliminated
// later; `swapped` says that this is the second of the two asked for.
struct BlockPlace {
    int offset = 0;
    bool swapped = false;
};

// The symbolic phase. Constant once analysed; may be shared.
class BlockPattern {
public:
    // Block i has sizes[i] rows (1 to 6); edges are pairs of blocks that have a block of A, in any order, repeated or not. Allocates.
    void analyse(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& edges);

    int count() const { return static_cast<int>(place_.size()); }
    int rows() const { return first_row_.empty() ? 0 : first_row_.back(); }
    int size(int block) const { return size_[place_[block]]; }
    int first_row(int block) const { return first_row_[place_[block]]; }
    int diagonal(int block) const { return diagonal_[place_[block]]; }
    BlockPlace off_diagonal(int block_a, int block_b) const;  // of two that have an edge
    int value_count() const { return value_count_; }
    // By turn of elimination, for what works along the tree of eliminations.
    int turn(int block) const { return place_[block]; }
    int turn_size(int turn) const { return size_[turn]; }
    // The first turn that eliminating this one changes, −1: none. All others that it changes are on the way from there to the root.
    int parent(int turn) const { return column_begin_[turn] < column_begin_[turn + 1] ? row_[column_begin_[turn]] : -1; }
    Real factor_flops() const { return flops_; }  // of one numeric factorisation

private:
    friend class BlockLdlt;
    int find(int column, int row) const;
    void order_blocks(const std::vector<std::pair<int, int>>& edges, std::vector<std::vector<int>>& columns);

    std::vector<int> place_;         // size n: block → its turn in the elimination
    std::vector<int> size_;          // by turn from here on
    std::vector<int> first_row_;     // size n + 1
    std::vector<int> diagonal_;      // offsets among the values
    std::vector<int> column_begin_;  // size n + 1, into row_ and lower_
    std::vector<int> row_;           // turns of the blocks below the diagonal, ascending within a column
    std::vector<int> lower_;         // their offsets
    std::vector<int> target_;        // offsets of the blocks that eliminating a column changes, in the order of the numeric phase
    int value_count_ = 0;
    Real flops_ = 0;
};

// The numeric phase. Allocates only when it meets a larger pattern than before.
class BlockLdlt {
public:
    // Sets all blocks to zero. The pattern must outlive the factor.
    void begin(const BlockPattern& pattern);
    // Row-major entries at an offset of the pattern; of the diagonal blocks all, of the others one of the two triangles is stored.
    Real* values(int offset) { return values_.data() + offset; }

    // Factors in place. Returns how many rows were dropped.
    int factor(Real drop);
    // x ← A⁻¹ x.
    void solve(Real* x) const;

    // Y ← L⁻¹ Y and Z = D⁻¹ Y for six right-hand sides at once that vanish outside `turns`: `count` of them, ascending, with each turn all
    // on its way to the root. Rows of turn k are the row-major 6 columns from 6 offset[k] on.
    void forward(const int* turns, int count, const int* offset, Real* Y, Real* Z) const;

    bool is_dropped(int row) const { return dropped_[row] != 0; }
    Real smallest_pivot() const { return smallest_pivot_; }  // of those kept, relative to the diagonal that the row began with

private:
    void invert_diagonal(int turn, Real drop);
    void eliminate(int turn, const int*& target);

    const BlockPattern* pattern_ = nullptr;
    std::vector<Real> values_;
    std::vector<Real> diagonal0_;  // by row: A's diagonal
    std::vector<Real> column_;     // scratch: the blocks of a column before they are multiplied by D⁻¹
    std::vector<char> dropped_;    // by row
    int dropped_count_ = 0;
    Real smallest_pivot_ = 1;
};

}  // namespace cairn
