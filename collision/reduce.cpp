#include "collision/reduce.hpp"

#include <algorithm>
#include <utility>

namespace cairn {
namespace {

constexpr Real kClearly = 1 + 1e-3;  // how much better a later candidate must be

// The deepest; of equally deep ones the farthest along a direction that is fixed in the plane.
int first_choice(const Candidate* c, int count, const Vec3& normal, Real depth_slack) {
    Real deepest = c[0].separation;
    for (int i = 1; i < count; ++i) deepest = std::min(deepest, c[i].separation);
    const Vec3 along = any_perpendicular(normal) + Vec3(0.0123, 0.0345, 0.0567);  // askew: rectangles have no ties
    int best = -1;
    Real farthest = 0;
    for (int i = 0; i < count; ++i) {
        if (c[i].separation > deepest + depth_slack) continue;
        const Real x = along.dot(c[i].foot);
        if (best < 0 || x > farthest) best = i, farthest = x;
    }
    return best;
}

int farthest_from(const Candidate* c, int count, const Vec3& p) {
    int best = 0;
    Real farthest = -1;
    for (int i = 0; i < count; ++i) {
        const Real d2 = (c[i].foot - p).squaredNorm();
        if (d2 > farthest * kClearly) best = i, farthest = d2;
    }
    return best;
}

}  // namespace

int reduce(Candidate* c, int count, const Vec3& normal, Real depth_slack) {
    if (count <= 4) return count;
    std::swap(c[0], c[first_choice(c, count, normal, depth_slack)]);
    std::swap(c[1], c[1 + farthest_from(c + 1, count - 1, c[0].foot)]);

    // The largest triangle on either side of the line through the first two, then the largest triangle outside that triangle.
    const auto area = [&](const Vec3& p, const Vec3& q, const Vec3& r) { return normal.dot((q - p).cross(r - p)); };
    int best = 2;
    Real largest = 0;
    for (int i = 2; i < count; ++i) {
        const Real a = std::abs(area(c[0].foot, c[1].foot, c[i].foot));
        if (a > largest * kClearly) best = i, largest = a;
    }
    std::swap(c[2], c[best]);
    if (area(c[0].foot, c[1].foot, c[2].foot) < 0) std::swap(c[1], c[2]);

    best = -1;
    largest = 0;
    for (int i = 3; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const Real a = -area(c[k].foot, c[(k + 1) % 3].foot, c[i].foot);
            if (a > largest * kClearly) best = i, largest = a;
        }
    }
    if (best < 0) return 3;
    std::swap(c[3], c[best]);
    return 4;
}

}  // namespace cairn
