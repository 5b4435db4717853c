#include "solver/block_ldlt.hpp"

#include <algorithm>
#include <iterator>
#include <set>

namespace cairn {
namespace {

// Calls f with the number of rows as a constant, so that inner loops have a fixed length.
template <typename Function>
void with_size(int n, Function f) {
    switch (n) {
        case 1:
            return f(std::integral_constant<int, 1>());
        case 2:
            return f(std::integral_constant<int, 2>());
        case 3:
            return f(std::integral_constant<int, 3>());
        case 4:
            return f(std::integral_constant<int, 4>());
        case 5:
            return f(std::integral_constant<int, 5>());
        default:
            return f(std::integral_constant<int, 6>());
    }
}

template <int K>
Real dot(const Real* a, const Real* b) {
    Real sum = a[0] * b[0];
    for (int k = 1; k < K; ++k) sum += a[k] * b[k];
    return sum;
}

}  // namespace

void BlockPattern::order_blocks(const std::vector<std::pair<int, int>>& edges, std::vector<std::vector<int>>& columns) {
    const int n = static_cast<int>(columns.size());
    std::vector<std::vector<int>> adjacent(n);
    for (const auto& [a, b] : edges) {
        if (a == b) continue;
        adjacent[a].push_back(b);
        adjacent[b].push_back(a);
    }
    std::set<std::pair<int, int>> queue;  // (degree, block)
    for (int i = 0; i < n; ++i) {
        std::sort(adjacent[i].begin(), adjacent[i].end());
        adjacent[i].erase(std::unique(adjacent[i].begin(), adjacent[i].end()), adjacent[i].end());
        queue.insert({static_cast<int>(adjacent[i].size()), i});
    }
    std::vector<int> merged;
    for (int turn = 0; turn < n; ++turn) {
        const int block = queue.begin()->second;
        queue.erase(queue.begin());
        place_[block] = turn;
        const std::vector<int> neighbours = std::move(adjacent[block]);
        for (int u : neighbours) {
            queue.erase({static_cast<int>(adjacent[u].size()), u});
            merged.clear();
            std::set_union(adjacent[u].begin(), adjacent[u].end(), neighbours.begin(), neighbours.end(), std::back_inserter(merged));
            merged.erase(std::remove_if(merged.begin(), merged.end(), [&](int t) { return t == u || t == block; }), merged.end());
            adjacent[u] = merged;
            queue.insert({static_cast<int>(adjacent[u].size()), u});
        }
        columns[turn] = neighbours;
    }
}

void BlockPattern::analyse(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& edges) {
    const int n = static_cast<int>(sizes.size());
    std::vector<std::vector<int>> columns(n);
    place_.assign(n, 0);
    order_blocks(edges, columns);

    size_.assign(n, 0);
    for (int i = 0; i < n; ++i) size_[place_[i]] = sizes[i];
    first_row_.assign(n + 1, 0);
    diagonal_.assign(n, 0);
    column_begin_.assign(n + 1, 0);
    row_.clear();
    lower_.clear();
    value_count_ = 0;
    for (int k = 0; k < n; ++k) {
        first_row_[k + 1] = first_row_[k] + size_[k];
        diagonal_[k] = value_count_;
        value_count_ += size_[k] * size_[k];
        for (int& u : columns[k]) u = place_[u];
        std::sort(columns[k].begin(), columns[k].end());
        for (int u : columns[k]) {
            row_.push_back(u);
            lower_.push_back(value_count_);
            value_count_ += size_[u] * size_[k];
        }
        column_begin_[k + 1] = static_cast<int>(row_.size());
    }

    target_.clear();
    flops_ = 0;
    for (int k = 0; k < n; ++k) {
        const Real s = size_[k];
        flops_ += s * s * s;
        for (int p = column_begin_[k]; p < column_begin_[k + 1]; ++p) {
            flops_ += 2 * size_[row_[p]] * s * s;
            for (int q = column_begin_[k]; q <= p; ++q) {
                target_.push_back(p == q ? diagonal_[row_[p]] : lower_[find(row_[q], row_[p])]);
                flops_ += 2 * size_[row_[p]] * size_[row_[q]] * s;
            }
        }
    }
}

int BlockPattern::find(int column, int row) const {
    const auto begin = row_.begin() + column_begin_[column], end = row_.begin() + column_begin_[column + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - row_.begin());
}

BlockPlace BlockPattern::off_diagonal(int block_a, int block_b) const {
    const int a = place_[block_a], b = place_[block_b];
    return a > b ? BlockPlace{lower_[find(b, a)], false} : BlockPlace{lower_[find(a, b)], true};
}

void BlockLdlt::begin(const BlockPattern& pattern) {
    pattern_ = &pattern;
    values_.assign(pattern.value_count_, 0);
    diagonal0_.resize(pattern.rows());
    dropped_.resize(pattern.rows());
}

int BlockLdlt::factor(Real drop) {
    const BlockPattern& p = *pattern_;
    const int n = p.count();
    dropped_count_ = 0;
    smallest_pivot_ = 1;
    for (int k = 0; k < n; ++k)
        for (int r = 0; r < p.size_[k]; ++r) diagonal0_[p.first_row_[k] + r] = values_[p.diagonal_[k] + r * p.size_[k] + r];
    const int* target = p.target_.data();
    for (int k = 0; k < n; ++k) {
        invert_diagonal(k, drop);
        eliminate(k, target);
    }
    return dropped_count_;
}

// Gauss-Jordan elimination in place, row by row; rows whose pivot has vanished are left out, which makes the inverse that of the others.
void BlockLdlt::invert_diagonal(int turn, Real drop) {
    const int row0 = pattern_->first_row_[turn];
    Real* m = values(pattern_->diagonal_[turn]);
    with_size(pattern_->size_[turn], [&](auto size) {
        constexpr int N = decltype(size)::value;
        bool any = false;
        for (int k = 0; k < N; ++k) {
            const Real pivot = m[k * N + k], first = diagonal0_[row0 + k];
            const bool drops = !(pivot > drop * first);
            dropped_[row0 + k] = drops;
            any |= drops;
            if (drops) continue;
            smallest_pivot_ = std::min(smallest_pivot_, pivot / first);
            const Real inverse = 1 / pivot;
            m[k * N + k] = 1;
            for (int c = 0; c < N; ++c) m[k * N + c] *= inverse;
            for (int r = 0; r < N; ++r) {
                if (r == k) continue;
                const Real f = m[r * N + k];
                m[r * N + k] = 0;
                for (int c = 0; c < N; ++c) m[r * N + c] -= f * m[k * N + c];
            }
        }
        if (!any) return;
        for (int k = 0; k < N; ++k) {
            if (!dropped_[row0 + k]) continue;
            ++dropped_count_;
            for (int c = 0; c < N; ++c) m[k * N + c] = m[c * N + k] = 0;
        }
    });
}

void BlockLdlt::eliminate(int turn, const int*& target) {
    const BlockPattern& p = *pattern_;
    const int begin = p.column_begin_[turn], end = p.column_begin_[turn + 1];
    if (begin == end) return;
    const Real* D = values(p.diagonal_[turn]);
    with_size(p.size_[turn], [&](auto size) {
        constexpr int K = decltype(size)::value;
        if (column_.size() < static_cast<std::size_t>((end - begin) * kMaxBlockRows * K)) column_.resize((end - begin) * kMaxBlockRows * K);
        for (int i = begin; i < end; ++i) {
            Real* L = values(p.lower_[i]);
            Real* old = column_.data() + (i - begin) * kMaxBlockRows * K;
            const int rows = p.size_[p.row_[i]];
            std::copy_n(L, rows * K, old);
            for (int r = 0; r < rows; ++r)
                for (int c = 0; c < K; ++c) L[r * K + c] = dot<K>(old + r * K, D + c * K);  // D⁻¹ is symmetric
        }
        for (int i = begin; i < end; ++i) {
            const Real* L = values(p.lower_[i]);
            const int rows = p.size_[p.row_[i]];
            for (int j = begin; j <= i; ++j) {
                const Real* old = column_.data() + (j - begin) * kMaxBlockRows * K;
                const int columns = p.size_[p.row_[j]];
                Real* T = values(*target++);
                for (int r = 0; r < rows; ++r)
                    for (int c = 0; c < columns; ++c) T[r * columns + c] -= dot<K>(L + r * K, old + c * K);
            }
        }
    });
}

void BlockLdlt::solve(Real* x) const {
    const BlockPattern& p = *pattern_;
    const int n = p.count();
    for (int k = 0; k < n; ++k) {
        const Real* x_k = x + p.first_row_[k];
        with_size(p.size_[k], [&](auto size) {
            constexpr int K = decltype(size)::value;
            for (int i = p.column_begin_[k]; i < p.column_begin_[k + 1]; ++i) {
                const Real* L = values_.data() + p.lower_[i];
                Real* x_i = x + p.first_row_[p.row_[i]];
                for (int r = 0; r < p.size_[p.row_[i]]; ++r) x_i[r] -= dot<K>(L + r * K, x_k);
            }
        });
    }
    for (int k = n - 1; k >= 0; --k) {
        Real* x_k = x + p.first_row_[k];
        const Real* D = values_.data() + p.diagonal_[k];
        with_size(p.size_[k], [&](auto size) {
            constexpr int K = decltype(size)::value;
            Real y[K];
            for (int r = 0; r < K; ++r) y[r] = dot<K>(D + r * K, x_k);
            for (int i = p.column_begin_[k]; i < p.column_begin_[k + 1]; ++i) {
                const Real* L = values_.data() + p.lower_[i];
                const Real* x_i = x + p.first_row_[p.row_[i]];
                for (int r = 0; r < p.size_[p.row_[i]]; ++r)
                    for (int c = 0; c < K; ++c) y[c] -= L[r * K + c] * x_i[r];
            }
            std::copy_n(y, K, x_k);
        });
    }
}

void BlockLdlt::forward(const int* turns, int count, const int* offset, Real* Y, Real* Z) const {
    const BlockPattern& p = *pattern_;
    for (int n = 0; n < count; ++n) {
        const int k = turns[n];
        const Real* Y_k = Y + 6 * offset[k];
        Real* Z_k = Z + 6 * offset[k];
        const Real* D = values_.data() + p.diagonal_[k];
        with_size(p.size_[k], [&](auto size) {
            constexpr int K = decltype(size)::value;
            const auto add = [&](Real* out, const Real* row, Real sign) {
                for (int s = 0; s < K; ++s)
                    for (int c = 0; c < 6; ++c) out[c] += sign * row[s] * Y_k[6 * s + c];
            };
            for (int i = p.column_begin_[k]; i < p.column_begin_[k + 1]; ++i) {
                const Real* L = values_.data() + p.lower_[i];
                Real* Y_i = Y + 6 * offset[p.row_[i]];
                for (int r = 0; r < p.size_[p.row_[i]]; ++r) add(Y_i + 6 * r, L + r * K, -1);
            }
            std::fill_n(Z_k, 6 * K, 0.0);
            for (int r = 0; r < K; ++r) add(Z_k + 6 * r, D + r * K, 1);
        });
    }
}

}  // namespace cairn
