// Contacts of two shapes. FCL gives normals, depths and closest points (collision/fcl_*); faces are clipped here.
#pragma once

#include "collision/manifold.hpp"
#include "collision/shape.hpp"

#include <cstdint>
#include <vector>

namespace cairn {

// A shape and where it stands (X_WS = pose of its body times X_BS; for a plane X_WS is the body's pose).
struct PlacedShape {
    const Shape* shape = nullptr;
    Transform X_WS;
};

// What a pair of shapes remembers between queries. Plain data; the engine owns it, one per shape pair.
struct PairCache {
    static constexpr Real kNotApart = -1;
    Vec3 axis = Vec3::Zero();  // last separating axis or contact normal, in A's shape frame, from B to A; zero: none yet
    Real gap = kNotApart;      // [m], how far apart the last query found them along `axis`, at least; kNotApart: not beyond its margin

    bool is_apart() const { return gap >= 0; }
};

// Counters of the narrow phase; monotonic, cleared by the caller. An FCL or libccd failure (exception, iteration limit, non-finite result)
// is counted in `failures` and the query returns kFailed with nothing appended: the caller keeps the pair's last manifold.
struct NarrowStats {
    std::uint64_t queries = 0;               // calls of collide_shapes
    std::uint64_t separating_axis_hits = 0;  // answered by the cached axis alone
    std::uint64_t fcl_calls = 0;             // entries into FCL or libccd
    std::uint64_t failures = 0;
};

enum class NarrowResult : std::uint8_t { kSeparated, kTouching, kFailed };

// Appends to `out` the manifolds of A against B whose points are closer than `margin` [m, >= 0]; nothing if there are none.
// Any order of the two shapes; plane-plane, plane-mesh and mesh-mesh are never asked. Never throws; allocates only to grow `out` and
// its own thread-local scratch.
NarrowResult collide_shapes(const PlacedShape& a, const PlacedShape& b, Real margin, PairCache& cache, std::vector<Manifold>& out,
                            NarrowStats& stats) noexcept;

}  // namespace cairn
