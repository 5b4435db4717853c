// Splits a set of boxes in two for a bounding volume hierarchy. Internal to the collision room.
#pragma once

#include "collision/aabb.hpp"

#include <vector>

namespace cairn {

// Works on ranges of indices into a list of boxes. Deterministic; never allocates.
class BoxSplitter {
public:
    explicit BoxSplitter(const std::vector<Aabb>& boxes) : boxes_(boxes) {}

    // Of a range that is not empty.
    Aabb bounds(const int* first, const int* last) const;

    // Reorders a range of two or more so that its parts before and after the returned place, neither empty, make good children.
    // By the surface area heuristic where that helps and depth < 30, else halved by count: so a tree over an int count of boxes is never
    // deeper than 30 + 32.
    int* split(int* first, int* last, int depth) const;

private:
    Vec3 centre(int i) const { return 0.5 * (boxes_[i].lo + boxes_[i].hi); }
    int* split_by_area(int* first, int* last, int axis, Real lo, Real hi) const;

    const std::vector<Aabb>& boxes_;
};

}  // namespace cairn
