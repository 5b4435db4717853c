#include "collision/flat_tree.hpp"

#include <cmath>
#include <limits>

namespace cairn {
namespace {

// At most x. Conversion is off by half of a unit in the last place at most.
float below(Real x) {
    constexpr float kUlp = std::numeric_limits<float>::epsilon(), kLeast = std::numeric_limits<float>::min();
    const float nearest = static_cast<float>(x);
    return nearest - std::abs(nearest) * kUlp - kLeast;
}

}  // namespace

float FlatTree::rounded_down(Real x) {
    return std::abs(x) < static_cast<Real>(std::numeric_limits<float>::max()) ? below(x)
           : x < 0                                                            ? -std::numeric_limits<float>::infinity()
                                                                              : std::numeric_limits<float>::max();
}

void FlatTree::set_child(std::size_t node, int side, const Aabb& box, std::int32_t child) {
    for (int axis = 0; axis < 3; ++axis) {
        nodes_[node].bounds[axis][side] = rounded_down(box.lo[axis]);
        nodes_[node].bounds[axis][2 + side] = rounded_down(-box.hi[axis]);
    }
    nodes_[node].child[side] = child;
}

FlatTree::Asked FlatTree::asked(const Aabb& box) {
    Asked result;
    for (int axis = 0; axis < 3; ++axis) {
        const float hi = -rounded_down(-box.hi[axis]), lo = rounded_down(box.lo[axis]);
        result.bounds[axis] = Four{hi, hi, -lo, -lo};
    }
    return result;
}

}  // namespace cairn
