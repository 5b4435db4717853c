#include "collision/box_splitter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace cairn {
namespace {

constexpr int kBins = 12;
constexpr int kMaxAreaDepth = 30;

struct Bins {
    std::array<Aabb, kBins> box;
    std::array<int, kBins> count{};
    std::array<Real, kBins> cost{};  // cost[b]: of splitting before bin b; cost[0] means nothing

    void add(int b, const Aabb& a) { box[b] = count[b]++ ? box[b].merged(a) : a; }

    // Adds half area · count of what lies before (or, backward, from) each place.
    void add_costs(bool backward) {
        Aabb sum;
        int n = 0;
        for (int step = 0; step + 1 < kBins; ++step) {
            const int b = backward ? kBins - 1 - step : step;
            if (count[b] > 0) sum = n > 0 ? sum.merged(box[b]) : box[b];
            n += count[b];
            cost[backward ? b : b + 1] += n > 0 ? n * sum.half_area() : 0;
        }
    }
};

}  // namespace

Aabb BoxSplitter::bounds(const int* first, const int* last) const {
    Aabb box = boxes_[*first];
    for (const int* i = first; i != last; ++i) box = box.merged(boxes_[*i]);
    return box;
}

int* BoxSplitter::split(int* first, int* last, int depth) const {
    Vec3 lo = centre(*first), hi = lo;
    for (const int* i = first; i != last; ++i) {
        const Vec3 c = centre(*i);
        lo = lo.cwiseMin(c);
        hi = hi.cwiseMax(c);
    }
    int axis = 0;
    (hi - lo).maxCoeff(&axis);
    if (depth < kMaxAreaDepth && hi[axis] > lo[axis] && std::isfinite(hi[axis] - lo[axis])) {
        int* const middle = split_by_area(first, last, axis, lo[axis], hi[axis]);
        if (middle != first && middle != last) return middle;
    }
    int* const middle = first + (last - first) / 2;
    const auto before = [&](int a, int b) { return std::make_pair(centre(a)[axis], a) < std::make_pair(centre(b)[axis], b); };
    std::nth_element(first, middle, last, before);
    return middle;
}

// Surface area heuristic over bins along one axis (Wald 2007): the least Σ area · count of the children.
int* BoxSplitter::split_by_area(int* first, int* last, int axis, Real lo, Real hi) const {
    const Real scale = kBins / (hi - lo);
    const auto bin_of = [&](int i) { return std::min(kBins - 1, static_cast<int>(scale * (centre(i)[axis] - lo))); };
    Bins bins;
    for (const int* i = first; i != last; ++i) bins.add(bin_of(*i), boxes_[*i]);
    bins.add_costs(false);
    bins.add_costs(true);
    const int best = static_cast<int>(std::min_element(bins.cost.begin() + 1, bins.cost.end()) - bins.cost.begin());
    return std::partition(first, last, [&](int i) { return bin_of(i) < best; });
}

}  // namespace cairn
