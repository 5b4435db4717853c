#include "solver/block_cholesky.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>

// One source, compiled for the vector widths of today's machines and chosen at run time. Every lane does what the scalar code would, and
// nothing is fused, so that all give the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define CAIRN_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CAIRN_WIDE
#endif

namespace cairn {
namespace {

constexpr int kMostOfSupernode = 8;  // columns of a supernode: what they take from one column is to stay in the first cache

// c −= a bᵀ, all 6 × 6 column-major.
inline void subtract_product(Real* c, const Real* a, const Real* b) {
    for (int j = 0; j < 6; ++j) {
        Real sum[6] = {0, 0, 0, 0, 0, 0};
        for (int k = 0; k < 6; ++k) {
            const Real f = b[j + 6 * k];
            for (int i = 0; i < 6; ++i) sum[i] += a[i + 6 * k] * f;
        }
        for (int i = 0; i < 6; ++i) c[i + 6 * j] -= sum[i];
    }
}

// L⁻¹ of A = L Lᵀ (lower triangle of A read), lower triangular with zeros above; false if A is not positive definite.
bool invert_cholesky(Mat6& A) {
    Mat6 L = Mat6::Zero();
    for (int j = 0; j < 6; ++j) {
        Real d = A(j, j);
        for (int k = 0; k < j; ++k) d -= L(j, k) * L(j, k);
        if (!(d > 0) || !std::isfinite(d)) return false;
        const Real root = std::sqrt(d);
        L(j, j) = root;
        for (int i = j + 1; i < 6; ++i) {
            Real s = A(i, j);
            for (int k = 0; k < j; ++k) s -= L(i, k) * L(j, k);
            L(i, j) = s / root;
        }
    }
    A.setZero();
    for (int j = 0; j < 6; ++j) {
        A(j, j) = 1 / L(j, j);
        for (int i = j + 1; i < 6; ++i) {
            Real s = 0;
            for (int k = j; k < i; ++k) s -= L(i, k) * A(k, j);
            A(i, j) = s / L(i, i);
        }
    }
    return true;
}

// Fill-reducing order of a graph: position → vertex.
std::vector<int> minimum_degree(int n, const std::vector<std::pair<int, int>>& pairs) {
    std::vector<Eigen::Triplet<Real>> entries;
    entries.reserve(2 * pairs.size() + static_cast<std::size_t>(n));
    for (const auto& [i, j] : pairs) {
        entries.emplace_back(i, j, 1.0);
        entries.emplace_back(j, i, 1.0);
    }
    for (int i = 0; i < n; ++i) entries.emplace_back(i, i, 1.0);
    Eigen::SparseMatrix<Real> graph(n, n);
    graph.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
    Eigen::AMDOrdering<int>()(graph, permutation);
    return {permutation.indices().data(), permutation.indices().data() + n};
}

}  // namespace

void BlockCholesky::analyse(int n, const std::vector<std::pair<int, int>>& pairs) {
    n_ = n;
    order_ = minimum_degree(n, pairs);
    position_.resize(static_cast<std::size_t>(n));
    for (int k = 0; k < n; ++k) position_[order_[k]] = k;
    std::vector<std::vector<int>> below(static_cast<std::size_t>(n));
    for (const auto& [i, j] : pairs) {
        const int a = position_[i], b = position_[j];
        below[std::min(a, b)].push_back(std::max(a, b));
    }
    find_structure(below);

    diagonal_.resize(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) diagonal_[i] = start_[position_[i]];
    place_.resize(pairs.size());
    transposed_.resize(pairs.size());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const int a = position_[pairs[k].first], b = position_[pairs[k].second];
        const int row = std::max(a, b), column = std::min(a, b);
        const auto begin = rows_.begin() + start_[column], end = rows_.begin() + start_[column + 1];
        place_[k] = static_cast<int>(std::lower_bound(begin, end, row) - rows_.begin());
        transposed_[k] = a < b;
    }
    values_.resize(36 * rows_.size());
    local_.assign(static_cast<std::size_t>(n), 0);
    work_[0].resize(static_cast<std::size_t>(n));
}

// The rows of a column of L: those of H and those of its children in the elimination tree. `below` has H's.
void BlockCholesky::find_structure(const std::vector<std::vector<int>>& below) {
    std::vector<std::vector<int>> columns(static_cast<std::size_t>(n_)), children(static_cast<std::size_t>(n_));
    start_.assign(1, 0);
    rows_.clear();
    products_ = 0;
    for (int k = 0; k < n_; ++k) {
        std::vector<int>& column = columns[k];
        column = below[k];
        for (const int child : children[k]) {
            for (const int row : columns[child]) {
                if (row > k) column.push_back(row);
            }
        }
        std::sort(column.begin(), column.end());
        column.erase(std::unique(column.begin(), column.end()), column.end());
        if (!column.empty()) children[column.front()].push_back(k);
        rows_.push_back(k);
        rows_.insert(rows_.end(), column.begin(), column.end());
        start_.push_back(static_cast<int>(rows_.size()));
        const std::int64_t m = static_cast<std::int64_t>(column.size());
        products_ += 1 + m + m * (m + 1) / 2;
    }
    find_supernodes();
}

// A column belongs with the one before it if its rows are the same but for that one's.
void BlockCholesky::find_supernodes() {
    const auto length = [&](int column) { return start_[column + 1] - start_[column]; };
    supernode_.clear();
    for (int k = 0; k < n_; ++k) {
        const bool goes_on = k > 0 && length(k - 1) == length(k) + 1 && rows_[start_[k - 1] + 1] == k;
        if (!goes_on || k - supernode_.back() >= kMostOfSupernode) supernode_.push_back(k);
    }
    supernode_.push_back(n_);
    const int supernodes = static_cast<int>(supernode_.size()) - 1;
    std::vector<int> of_column(static_cast<std::size_t>(n_));
    for (int s = 0; s < supernodes; ++s) std::fill(of_column.begin() + supernode_[s], of_column.begin() + supernode_[s + 1], s);
    // f(supernode, column, place, count) for the rows of each column that lie in later supernodes, by column.
    const auto for_each_entry = [&](auto f) {
        for (int k = 0; k < n_; ++k)
            for (int p = start_[k] + 1, next; p < start_[k + 1]; p = next) {
                const int s = of_column[rows_[p]];
                for (next = p + 1; next < start_[k + 1] && of_column[rows_[next]] == s; ++next) {
                }
                if (s != of_column[k]) f(s, RowEntry{k, p, next - p});
            }
    };
    entry_start_.assign(static_cast<std::size_t>(supernodes) + 1, 0);
    for_each_entry([&](int s, const RowEntry&) { ++entry_start_[s + 1]; });
    for (int s = 0; s < supernodes; ++s) entry_start_[s + 1] += entry_start_[s];
    entries_.resize(static_cast<std::size_t>(entry_start_[supernodes]));
    std::vector<int> next(entry_start_.begin(), entry_start_.end() - 1);
    taken_.assign(static_cast<std::size_t>(supernodes), 0);
    for_each_entry([&](int s, const RowEntry& entry) {
        entries_[next[s]++] = entry;
        taken_[s] += static_cast<std::int64_t>(entry.count) * (start_[entry.column + 1] - entry.place);
    });
}

void BlockCholesky::set_zero() {
    std::fill(values_.begin(), values_.end(), 0.0);
}

// The products of earlier columns, in the order of these, for the rows [begin, end) of the supernode, by number.
CAIRN_WIDE void BlockCholesky::take_from_before(int supernode, int begin, int end) {
    const int first = supernode_[supernode], last_row = rows_[start_[first] + end - 1];
    for (int e = entry_start_[supernode]; e < entry_start_[supernode + 1]; ++e) {
        const RowEntry entry = entries_[e];
        const int column_end = start_[entry.column + 1];
        const Real* blocks[kMostOfSupernode];
        std::int64_t column[kMostOfSupernode];  // where a row's block is, less the row's number
        for (int q = 0; q < entry.count; ++q) {
            const int j = rows_[entry.place + q];
            blocks[q] = values_.data() + 36 * static_cast<std::int64_t>(entry.place + q);
            column[q] = start_[j] - (j - first);
        }
        int p = entry.place;
        if (begin > 0)
            p = static_cast<int>(std::lower_bound(&rows_[p], rows_.data() + column_end, rows_[start_[first] + begin]) - rows_.data());
        for (; p < column_end && rows_[p] <= last_row; ++p) {
            const Real* const L_ik = values_.data() + 36 * static_cast<std::int64_t>(p);
            const int row = local_[rows_[p]], count = std::min(entry.count, p - entry.place + 1);
            for (int q = 0; q < count; ++q) subtract_product(values_.data() + 36 * (column[q] + row), L_ik, blocks[q]);
        }
    }
}

// The products of each other, and the columns of L.
CAIRN_WIDE bool BlockCholesky::finish_columns(int supernode) {
    const int first = supernode_[supernode], last = supernode_[supernode + 1];
    for (int j = first; j < last; ++j) {
        for (int k = first; k < j; ++k) {
            const std::int64_t shift = start_[k] + (j - k);
            const Real* const L_jk = values_.data() + 36 * shift;
            for (int p = 0; p < start_[j + 1] - start_[j]; ++p)
                subtract_product(values_.data() + 36 * static_cast<std::int64_t>(start_[j] + p), values_.data() + 36 * (shift + p), L_jk);
        }
        Mat6 inverse = block(start_[j]);
        if (!invert_cholesky(inverse)) return false;
        block(start_[j]) = inverse;
        for (int p = start_[j] + 1; p < start_[j + 1]; ++p) {
            const Mat6 L_ij = block(p) * inverse.transpose();
            block(p) = L_ij;
        }
    }
    return true;
}

bool BlockCholesky::factorise(Team* team) {
    constexpr std::int64_t kWorthSharing = 500;  // products: some 20 µs
    constexpr std::size_t kPieces = 8;
    for (std::size_t s = 0; s + 1 < supernode_.size(); ++s) {
        const int first = supernode_[s], supernode = static_cast<int>(s), rows = start_[first + 1] - start_[first];
        for (int p = start_[first]; p < start_[first + 1]; ++p) local_[rows_[p]] = p - start_[first];
        if (team != nullptr && taken_[s] >= kWorthSharing) {
            const std::size_t piece = (static_cast<std::size_t>(rows) + kPieces - 1) / kPieces;
            team->for_pieces(static_cast<std::size_t>(rows), piece, [&](std::size_t begin, std::size_t end, int) {
                take_from_before(supernode, static_cast<int>(begin), static_cast<int>(end));
            });
        } else {
            take_from_before(supernode, 0, rows);
        }
        if (!finish_columns(supernode)) return false;
    }
    return true;
}

void BlockCholesky::solve(std::vector<Vec6>& x, int worker) const {
    std::vector<Vec6>& work = work_[static_cast<std::size_t>(worker)];
    work.resize(static_cast<std::size_t>(n_));
    for (int k = 0; k < n_; ++k) work[k] = x[order_[k]];
    for (int k = 0; k < n_; ++k) {
        const Vec6 y = block(start_[k]).triangularView<Eigen::Lower>() * work[k];
        work[k] = y;
        for (int p = start_[k] + 1; p < start_[k + 1]; ++p) work[rows_[p]].noalias() -= block(p) * y;
    }
    for (int k = n_ - 1; k >= 0; --k) {
        Vec6 y = work[k];
        for (int p = start_[k] + 1; p < start_[k + 1]; ++p) y.noalias() -= block(p).transpose() * work[rows_[p]];
        work[k] = block(start_[k]).transpose() * y;
    }
    for (int k = 0; k < n_; ++k) x[order_[k]] = work[k];
}

}  // namespace cairn
