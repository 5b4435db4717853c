// The wide kernels' rows at the new poses. Internal; compiled once for each instruction set (wide_math.hpp). The order of the operations
// is that of build_block in contact_rows.cpp, which has the reasons.
#pragma once

#include "solver/wide_rows.hpp"

namespace cairn {
namespace CAIRN_WIDE_SET {

struct BatchPose {
    Vec x, acceleration;
    V4 inv_mass, turned;
    Mat R, inv_inertia;
};

CAIRN_WIDE_INLINE BatchPose pose_of(const WideView& s, const int* body) {
    const WidePose &p0 = s.poses[body[0]], &p1 = s.poses[body[1]], &p2 = s.poses[body[2]], &p3 = s.poses[body[3]];
    BatchPose pose;
    V4 unused;
    gather4(p0.x, p1.x, p2.x, p3.x, pose.x, pose.inv_mass);
    gather4(p0.R0, p1.R0, p2.R0, p3.R0, pose.R.c0, pose.turned);
    gather4(p0.R1, p1.R1, p2.R1, p3.R1, pose.R.c1, pose.acceleration.x);
    gather4(p0.R2, p1.R2, p2.R2, p3.R2, pose.R.c2, pose.acceleration.y);
    gather4(p0.I0, p1.I0, p2.I0, p3.I0, pose.inv_inertia.c0, pose.acceleration.z);
    gather4(p0.I1, p1.I1, p2.I1, p3.I1, pose.inv_inertia.c1, unused);
    gather4(p0.I2, p1.I2, p2.I2, p3.I2, pose.inv_inertia.c2, unused);
    return pose;
}

// Which lanes are built: those of a mask, or all of them, whatever they hold.
struct SomeLanes {
    M4 mask;
};
struct AllLanes {};

CAIRN_WIDE_INLINE void save(Wide& w, SomeLanes lanes, V4 v) {
    save(w, select(lanes.mask, v, load(w)));
}
CAIRN_WIDE_INLINE void save(Wide& w, AllLanes, V4 v) {
    save(w, v);
}
template <typename Lanes>
CAIRN_WIDE_INLINE void save(WideVec& w, Lanes lanes, const Vec& v) {
    save(w.x, lanes, v.x);
    save(w.y, lanes, v.y);
    save(w.z, lanes, v.z);
}

// Sets the lanes of a row along `direction` at the arms r_a, r_b; `used` lanes get their mass. Returns S⁻¹, ∞ where not used.
template <typename Lanes>
CAIRN_WIDE_INLINE V4 build_row(WideRow& row, Lanes lanes, M4 used, const Vec& direction, const Vec& r_a, const Vec& r_b, const BatchPose& a,
                               const BatchPose& b) {
    const Vec ang_a = cross(r_a, direction), ang_b = cross(r_b, direction);
    const Vec iang_a = a.inv_inertia * ang_a, iang_b = b.inv_inertia * ang_b;
    const V4 S = a.inv_mass + b.inv_mass + dot(ang_a, iang_a) + dot(ang_b, iang_b);
    const V4 mass = all(1) / select(used, S, all(1));
    save(row.ang_a, lanes, ang_a);
    save(row.ang_b, lanes, ang_b);
    save(row.iang_a, lanes, iang_a);
    save(row.iang_b, lanes, iang_b);
    save(row.mass, lanes, select(used, mass, all(0)));
    return select(used, mass, all(kInfinite));
}

// Some unit vector perpendicular to n, as any_perpendicular has it.
CAIRN_WIDE_INLINE Vec perpendicular(const Vec& n) {
    const M4 along_x = magnitude(n.x) < 0.57735;
    const Vec e = {select(along_x, all(1), all(0)), select(along_x, all(0), all(1)), all(0)};
    const Vec t = cross(n, e);
    const V4 length = root(dot(t, t));
    return {t.x / length, t.y / length, t.z / length};
}

CAIRN_WIDE_INLINE Vec tangent(const Vec& previous, const Vec& n) {
    constexpr double kLeast = 1e-3;
    const V4 d = dot(n, previous);
    const Vec t = previous - Vec{n.x * d, n.y * d, n.z * d};
    const V4 length = root(dot(t, t));
    const M4 says = length > kLeast * root(dot(previous, previous));
    const Vec unit = {t.x / length, t.y / length, t.z / length};
    return any(~says) ? select(says, unit, perpendicular(n)) : unit;
}

struct Arms {
    Vec a, b;
};

// Surface points, their separation and its curvature.
template <typename Lanes>
CAIRN_WIDE_INLINE Arms build_point(WidePoint& point, Lanes lanes, M4 turns_with_a, M4 turns_with_b, const Vec& n, const BatchPose& a,
                                   const BatchPose& b, const BatchVelocity& u) {
    const Vec core_a = a.R * load(point.core_a), core_b = b.R * load(point.core_b);
    const V4 radius_a = load(point.radius_a), radius_b = load(point.radius_b);
    const V4 separation = dot(n, a.x + core_a - b.x - core_b) - radius_a - radius_b;
    const Vec b_of_face = core_b + radius_b * n, a_of_face = b.x + b_of_face + separation * n - a.x;
    const Vec a_of_core = core_a - radius_a * n, b_of_core = a.x + a_of_core - separation * n - b.x;
    V4 curvature = select(turns_with_a, all(0), dot(n, cross(u.wa, cross(u.wa, core_a))));
    curvature = curvature - select(turns_with_b, all(0), dot(n, cross(u.wb, cross(u.wb, core_b))));
    save(point.separation, lanes, separation);
    save(point.curvature, lanes, curvature);
    return {select(turns_with_a, a_of_face, a_of_core), select(turns_with_a, b_of_face, b_of_core)};
}

// Rows of a batch along its normals and tangents as they are.
template <typename Lanes>
CAIRN_WIDE_INLINE void build_rows(const WideView& s, int k, Lanes lanes, const BatchPose& a, const BatchPose& b) {
    WideBatch& batch = s.batches[k];
    WideBatchBuild& build = s.builds[k];
    const M4 turns_with_a = load(build.turns_with_a) != 0, turns_with_b = load(build.turns_with_b) != 0;
    save(build.built_turn_a, lanes, a.turned);
    save(build.built_turn_b, lanes, b.turned);
    const Vec n = load(batch.n);
    const BatchVelocity u = velocity_of(s, batch);
    const M4 rubs = load(batch.mu) > 0;
    V4 least_mass = all(kInfinite);
    for (int i = 0; i < batch.count; ++i) {
        WidePoint& point = s.points[batch.first + i];
        const M4 used = load(point.is_used) != 0;
        const Arms r = build_point(point, lanes, turns_with_a, turns_with_b, n, a, b, u);
        least_mass = smaller(least_mass, build_row(s.normals[batch.first + i], lanes, used, n, r.a, r.b, a, b));
        for (int j = 0; j < 2 && batch.friction >= 0; ++j) {
            WideFriction& row = s.frictions[batch.friction + 2 * i + j];
            least_mass = smaller(least_mass, build_row(row, lanes, used & rubs, load(row.t), r.a, r.b, a, b));
        }
    }
    save(batch.max_inv_mass, lanes, all(1) / least_mass);
}

// Normals and tangents of a batch at the present poses.
template <typename Lanes>
CAIRN_WIDE_INLINE void orient(const WideView& s, int k, Lanes lanes, const BatchPose& a, const BatchPose& b) {
    WideBatch& batch = s.batches[k];
    const WideBatchBuild& build = s.builds[k];
    const M4 turns_with_a = load(build.turns_with_a) != 0, turns_with_b = load(build.turns_with_b) != 0;
    const Vec n_local = load(build.n_local);
    const Vec n = select(turns_with_a, a.R * n_local, select(turns_with_b, b.R * n_local, load(batch.n)));
    save(batch.n, lanes, n);
    for (int i = 0; i < batch.count && batch.friction >= 0; ++i) {
        WideFriction* rows = &s.frictions[batch.friction + 2 * i];
        const Vec t1 = tangent(load(rows[0].t), n);
        save(rows[0].t, lanes, t1);
        save(rows[1].t, lanes, cross(n, t1));
    }
}

template <typename Lanes>
CAIRN_WIDE_INLINE void renew(const WideView& s, int k, Lanes lanes) {
    const BatchPose a = pose_of(s, s.batches[k].a), b = pose_of(s, s.batches[k].b);
    orient(s, k, lanes, a, b);
    build_rows(s, k, lanes, a, b);
}

static void advance(const WideView& s, int begin, int end, double h, double tolerance) {
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        const WideBatchBuild& build = s.builds[k];
        const WidePose* poses = s.poses;
        const V4 turned_a = {poses[batch.a[0]].turned, poses[batch.a[1]].turned, poses[batch.a[2]].turned, poses[batch.a[3]].turned};
        const V4 turned_b = {poses[batch.b[0]].turned, poses[batch.b[1]].turned, poses[batch.b[2]].turned, poses[batch.b[3]].turned};
        const M4 turns = turned_a - load(build.built_turn_a) + turned_b - load(build.built_turn_b) > tolerance;
        if (!any(~turns)) {
            renew(s, k, AllLanes{});
            continue;
        }
        const BatchVelocity u = velocity_of(s, batch);
        const Vec n = load(batch.n);
        for (int p = batch.first; p < batch.first + batch.count; ++p)
            save(s.points[p].separation, load(s.points[p].separation) + all(h) * along(u, n, s.normals[p]));
        if (any(turns)) renew(s, k, SomeLanes{turns});
    }
}

}  // namespace CAIRN_WIDE_SET
}  // namespace cairn
