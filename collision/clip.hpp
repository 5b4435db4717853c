// Clipping of one convex shape's feature by a face of another (Sutherland and Hodgman 1974), with names for the corners that stay the same
// while the shapes slide. All in one frame; no allocation.
#pragma once

#include "engine/base/math.hpp"

#include <cstdint>

namespace cairn {

constexpr int kMaxOutline = 32;        // corners of a face that is clipped or clips; larger faces are thinned out
constexpr int kMaxClipped = 64;        // corners of the outcome
constexpr std::uint8_t kSideBit = 64;  // added to the number of a side of the clipping face

// A convex polygon in space. edge[i] names the edge that leaves corner i; the one that arrives is edge[i − 1].
struct Polygon {
    int count = 0;
    Vec3 corner[kMaxClipped];
    std::uint8_t edge[kMaxClipped];

    void add(const Vec3& p, std::uint8_t name) {
        if (count == kMaxClipped) return;
        corner[count] = p;
        edge[count++] = name;
    }
};

// A planar face: outward unit normal, normal·x = offset on it, outline counter-clockwise seen from outside. No corners: the whole plane.
// A disc has both its circle and an outline of points on it.
struct Face {
    Vec3 normal = Vec3::UnitZ();
    Real offset = 0;
    int index = 0;         // which face of its shape
    Real disc_radius = 0;  // 0: no disc
    Vec3 disc_centre = Vec3::Zero();
    Polygon outline;
    const Vec3* side = nullptr;  // outward unit normals of the outline's sides where they are known, size outline.count
};

// The part of `polygon` above or below the face, cut along the face's sides (planes through its edges along its normal). Corners no farther
// outside than `slack` [m] count as inside, so that rounding does not cut faces that match.
void clip(const Polygon& polygon, const Face& face, Real slack, Polygon& out);

// Likewise for the segment p[0] p[1]; name[i] is set to kSideBit + side where end i was cut. False if nothing is left.
bool clip_segment(Vec3 p[2], std::uint8_t name[2], const Face& face, Real slack);

// True if the point is above or below the face.
bool is_over(const Vec3& point, const Face& face, Real slack);

}  // namespace cairn
