#include "collision/clip.hpp"

#include <utility>

namespace cairn {
namespace {

// The outward unit normal of side k of a face.
Vec3 side_normal(const Face& face, int k) {
    if (face.side != nullptr) return face.side[k];
    const Polygon& o = face.outline;
    const Vec3 along = o.corner[k + 1 == o.count ? 0 : k + 1] - o.corner[k];
    return along.cross(face.normal).normalized();
}

// Keeps what is inside the plane m·x = offset, whose cut gets the name `side`.
void cut(const Polygon& in, const Vec3& m, Real offset, Real slack, std::uint8_t side, Polygon& out) {
    out.count = 0;
    Real d = m.dot(in.corner[0]) - offset;
    const Real first = d;
    for (int i = 0; i < in.count; ++i) {
        const int j = i + 1 == in.count ? 0 : i + 1;
        const Real next = j == 0 ? first : m.dot(in.corner[j]) - offset;
        const bool inside = d <= slack, next_inside = next <= slack;
        if (inside && next_inside) {
            out.add(in.corner[i], in.edge[i]);
        } else if (inside) {
            // A corner on the plane leaves along the cut itself: a second corner at the same place would help nobody.
            if (d < 0) {
                out.add(in.corner[i], in.edge[i]);
                out.add(in.corner[i] + (d / (d - next)) * (in.corner[j] - in.corner[i]), side);
            } else {
                out.add(in.corner[i], side);
            }
        } else if (next_inside && next < 0) {
            out.add(in.corner[j] + (next / (next - d)) * (in.corner[i] - in.corner[j]), in.edge[i]);
        }
        d = next;
    }
}

// Distance of a point from a disc's axis.
Real from_axis(const Vec3& p, const Face& disc) {
    const Vec3 d = p - disc.disc_centre;
    return (d - disc.normal.dot(d) * disc.normal).norm();
}

bool is_all_over_disc(const Polygon& polygon, const Face& disc, Real slack) {
    for (int i = 0; i < polygon.count; ++i)
        if (from_axis(polygon.corner[i], disc) > disc.disc_radius + slack) return false;
    return true;
}

// The piece of a segment over a disc: |p + t d| <= radius in its plane.
bool clip_segment_to_disc(Vec3 p[2], std::uint8_t name[2], const Face& disc, Real slack) {
    const Vec3 u = p[1] - p[0], start = p[0] - disc.disc_centre;
    const Vec3 d = u - disc.normal.dot(u) * disc.normal, s = start - disc.normal.dot(start) * disc.normal;
    const Real r = disc.disc_radius + slack;
    const Real a = d.squaredNorm(), b = s.dot(d), c = s.squaredNorm() - r * r;
    if (!(a > 1e-24 * r * r)) return c <= 0;
    const Real discriminant = b * b - a * c;
    if (discriminant < 0) return false;
    const Real root = std::sqrt(discriminant);
    const Real t0 = (-b - root) / a, t1 = (-b + root) / a;
    if (t0 > 1 || t1 < 0) return false;
    const Vec3 origin = p[0];
    if (t1 < 1) {
        p[1] = origin + t1 * u;
        name[1] = kSideBit;
    }
    if (t0 > 0) {
        p[0] = origin + t0 * u;
        name[0] = kSideBit;
    }
    return true;
}

}  // namespace

void clip(const Polygon& polygon, const Face& face, Real slack, Polygon& out) {
    const int sides = face.outline.count;
    if (sides == 0 || (face.disc_radius > 0 && is_all_over_disc(polygon, face, slack))) {
        out = polygon;
        return;
    }
    Polygon other;
    // The last cut must land in `out`.
    Polygon* to = sides % 2 == 1 ? &out : &other;
    Polygon* spare = sides % 2 == 1 ? &other : &out;
    const Polygon* from = &polygon;
    for (int k = 0; k < sides; ++k) {
        const Vec3 m = side_normal(face, k);
        cut(*from, m, m.dot(face.outline.corner[k]), slack, static_cast<std::uint8_t>(kSideBit + k), *to);
        if (to->count == 0) {
            out.count = 0;
            return;
        }
        from = to;
        std::swap(to, spare);
    }
}

bool clip_segment(Vec3 p[2], std::uint8_t name[2], const Face& face, Real slack) {
    if (face.disc_radius > 0) return clip_segment_to_disc(p, name, face, slack);
    for (int k = 0; k < face.outline.count; ++k) {
        const Vec3 m = side_normal(face, k);
        const Real offset = m.dot(face.outline.corner[k]);
        const Real d[2] = {m.dot(p[0]) - offset, m.dot(p[1]) - offset};
        if (d[0] > slack && d[1] > slack) return false;
        for (int i = 0; i < 2; ++i) {
            if (d[i] <= slack) continue;
            const int j = 1 - i;
            p[i] = d[j] < 0 ? Vec3(p[j] + (d[j] / (d[j] - d[i])) * (p[i] - p[j])) : p[j];
            name[i] = static_cast<std::uint8_t>(kSideBit + k);
        }
    }
    return true;
}

bool is_over(const Vec3& point, const Face& face, Real slack) {
    if (face.disc_radius > 0) return from_axis(point, face) <= face.disc_radius + slack;
    for (int k = 0; k < face.outline.count; ++k)
        if (side_normal(face, k).dot(point - face.outline.corner[k]) > slack) return false;
    return true;
}

}  // namespace cairn
