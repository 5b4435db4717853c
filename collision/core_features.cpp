#include "collision/core_features.hpp"

#include "collision/hull.hpp"

namespace cairn {

using fcl_query::Core;

Real core_support(const PlacedShape& s, const Core& core, const Vec3& d) {
    switch (core.kind) {
        case Core::Kind::kBox:
            return d.dot(core.p) + (core.R.transpose() * d).cwiseAbs().dot(core.half);
        case Core::Kind::kSegment:
            return d.dot(core.p) + std::abs(d.dot(core.R.col(2))) * core.half.z();
        default: {  // a hull's, drawn in towards its centre
            const Real centre = d.dot(core.R * core.centre + core.p);
            return centre + core.scale * (support(s, d) - centre);
        }
    }
}

Vec3 core_support_point(const PlacedShape& s, const Core& core, const Vec3& d) {
    switch (core.kind) {
        case Core::Kind::kBox: {
            const Vec3 local = core.R.transpose() * d;
            Vec3 corner;
            for (int k = 0; k < 3; ++k) corner[k] = local[k] > 0 ? core.half[k] : -core.half[k];
            return core.R * corner + core.p;
        }
        case Core::Kind::kSegment: {
            const Vec3 z = core.R.col(2);
            return core.p + (z.dot(d) > 0 ? core.half.z() : -core.half.z()) * z;
        }
        default: {
            const Vec3 centre = core.R * core.centre + core.p;
            return centre + core.scale * (support_point(s, d) - centre);
        }
    }
}

bool core_edge(const PlacedShape& s, const Core& core, const Vec3& n, AxisSegment& edge) {
    if (core.kind != Core::Kind::kBox && core.kind != Core::Kind::kSegment && core.kind != Core::Kind::kPoints) return false;
    edge = core.kind == Core::Kind::kBox ? box_edge_against(s.X_WS, core.half, n) : edge_against(s, n);
    if (core.kind == Core::Kind::kPoints) {
        const Vec3 centre = core.R * core.centre + core.p;
        for (Vec3& end : edge.end) end = centre + core.scale * (end - centre);
    }
    return true;
}

bool closest_of_segments(const AxisSegment& a, const AxisSegment& b, Real least, fcl_query::Closest& closest) {
    fcl_query::segment_segment(a.end[0], a.end[1], b.end[0], b.end[1], closest.a, closest.b);
    const Vec3 d = closest.a - closest.b;
    closest.distance = d.norm();
    if (!(closest.distance > least)) return false;
    closest.n = d / closest.distance;
    return true;
}

}  // namespace cairn
