#include "apps/cli/truths/extrapolation.hpp"

#include "engine/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::cli {

namespace {

constexpr int kColumns = 8;  // n = 2, 4 … 16 substeps: order 16

using Vector = std::vector<Real>;

// n midpoint substeps over H and Gragg's smoothing: the error is a series in even powers of H / n.
void midpoint(const Derivative& f, Real t, Real H, int n, const Vector& y, Vector& out) {
    const Real h = H / n;
    Vector before = y, now(y.size()), dy(y.size());
    f(t, y, dy);
    for (std::size_t i = 0; i < y.size(); ++i) now[i] = y[i] + h * dy[i];
    for (int k = 1; k < n; ++k) {
        f(t + k * h, now, dy);
        for (std::size_t i = 0; i < y.size(); ++i) before[i] += 2 * h * dy[i];
        std::swap(before, now);
    }
    f(t + H, now, dy);
    out.resize(y.size());
    for (std::size_t i = 0; i < y.size(); ++i) out[i] = (now[i] + before[i] + h * dy[i]) / 2;
}

// One step by extrapolation; returns the largest last correction, relative to 1 + |y|.
Real extrapolated_step(const Derivative& f, Real t, Real H, const Vector& y, Vector& out) {
    Vector table[kColumns];
    Real error = 0;
    for (int k = 0; k < kColumns; ++k) {
        Vector fresh;
        midpoint(f, t, H, 2 * (k + 1), y, fresh);
        // Neville's rule in h²: table[j] is the estimate from the last j + 1 substep counts.
        for (int j = 0; j < k; ++j) {
            const Real ratio = static_cast<Real>(k + 1) / (k - j), weight = 1 / (ratio * ratio - 1);
            error = 0;
            for (std::size_t i = 0; i < y.size(); ++i) {
                const Real correction = weight * (fresh[i] - table[j][i]);
                error = std::max(error, std::abs(correction) / (1 + std::abs(y[i])));
                const Real better = fresh[i] + correction;
                table[j][i] = fresh[i];
                fresh[i] = better;
            }
        }
        table[k] = std::move(fresh);
    }
    out = table[kColumns - 1];
    return std::isfinite(error) ? error : HUGE_VAL;
}

}  // namespace

void integrate(const Derivative& f, Real t0, Real t1, Real tolerance, std::vector<Real>& y) {
    Real t = t0, H = t1 - t0;
    Vector next;
    while (t < t1) {
        const bool last = t + H >= t1 - 1e-14 * std::abs(t1);
        if (last) H = t1 - t;
        const Real error = extrapolated_step(f, t, H, y, next);
        if (!(error <= tolerance)) {
            H /= 2;
            if (!(H > 1e-12 * (t1 - t0))) throw Error("reference: no step is small enough");
            continue;
        }
        std::swap(y, next);
        t = last ? t1 : t + H;
        if (error < tolerance / 1000) H *= 1.5;
    }
}

}  // namespace cairn::cli
