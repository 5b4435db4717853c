// The wide kernels' points from the states that outlast a step, and back. Internal; compiled once for each instruction set (wide_math.hpp).
// The order of the operations is that of point_load.cpp.
#pragma once

#include "solver/wide_build.hpp"

namespace cairn {
namespace CAIRN_WIDE_SET {

constexpr int kLoadAhead = 2;  // batches

// Batches take their blocks from anywhere, where no prefetcher of the machine expects them.
CAIRN_WIDE_INLINE void prefetch_states(const WideBatchBuild& build) {
    constexpr int kLine = 8;  // doubles
    for (int l = 0; l < kLanes; ++l)
        for (int at = 0; at < build.counts[l] * kStateStride; at += kLine) __builtin_prefetch(build.states[l] + at, 1);
}

CAIRN_WIDE_INLINE M4 lanes_with(const WideBatchBuild& build, int i) {
    return M4{-static_cast<long long>(i < build.counts[0]), -static_cast<long long>(i < build.counts[1]),
              -static_cast<long long>(i < build.counts[2]), -static_cast<long long>(i < build.counts[3])};
}

// Row `row` of the i-th points; nothing for lanes that have none.
struct StateRows {
    const double* l[kLanes];

    CAIRN_WIDE_INLINE StateRows of(const WideBatchBuild& build, int i) {
        alignas(32) static constexpr double kNothing[kStateStride] = {};
        StateRows rows;
        for (int l = 0; l < kLanes; ++l) rows.l[l] = i < build.counts[l] ? build.posed[l] + i * kStateStride : kNothing;
        return rows;
    }
    [[gnu::always_inline]] void gather(int row, Vec& v, V4& fourth) const {
        gather4(l[0] + row, l[1] + row, l[2] + row, l[3] + row, v, fourth);
    }
};

CAIRN_WIDE_INLINE void scatter_row(const WideBatchBuild& build, int i, int row, const Vec& v, V4 fourth) {
    V4 r[kLanes] = {v.x, v.y, v.z, fourth};
    transpose(r[0], r[1], r[2], r[3]);
    for (int l = 0; l < kLanes; ++l)
        if (i < build.counts[l]) *reinterpret_cast<V4Unaligned*>(build.states[l] + i * kStateStride + row) = r[l];
}

struct BatchPull {
    Vec tangential;
    V4 scale;
};

CAIRN_WIDE_INLINE BatchPull external_pull(const WideView& s, const Vec& n, const BatchPose& a, const BatchPose& b) {
    const V4 dt = all(s.load.dt);
    const Vec pull = dt * (a.acceleration - b.acceleration);
    return {pull - dot(n, pull) * n, dt * root(larger(dot(a.acceleration, a.acceleration), dot(b.acceleration, b.acceleration)))};
}

CAIRN_WIDE_INLINE Vec first_tangent(const WideView& s, const Vec& slip, const BatchPull& pull, const Vec& previous, const Vec& n) {
    if (s.load.fixed_tangents) return tangent(perpendicular(n), n);
    const V4 square = dot(slip, slip);
    const Vec predicted = slip + pull.tangential;
    const M4 slips = (square > 0) & (square > pull.scale * pull.scale), will_slip = root(dot(predicted, predicted)) > 1e-3 * pull.scale;
    return tangent(select(slips, slip, select(will_slip, predicted, previous)), n);
}

CAIRN_WIDE_INLINE void load_batch(const WideView& s, int k, const BatchPose& a, const BatchPose& b) {
    const WideBatch& batch = s.batches[k];
    const WideBatchBuild& build = s.builds[k];
    const Vec n = load(batch.n);
    const BatchVelocity u = velocity_of(s, batch);
    const BatchPull pull = external_pull(s, n, a, b);
    const Vec between = a.x - b.x;
    const V4 scale = all(s.load.warm_scale);
    const M4 rubs = load(batch.mu) > 0;
    for (int i = 0; i < batch.count; ++i) {
        const M4 used = lanes_with(build, i);
        const StateRows rows = StateRows::of(build, i);
        WidePoint& point = s.points[batch.first + i];
        WideWarm& warm = s.warm[batch.first + i];
        Vec core_a, core_b, previous, friction, friction_first;
        V4 radius_a, radius_b, separation, velocity, position;
        rows.gather(kStateCoreA, core_a, radius_a);
        rows.gather(kStateCoreB, core_b, radius_b);
        rows.gather(kStateTangent, previous, separation);
        rows.gather(kStateFriction, friction, velocity);
        rows.gather(kStateFrictionFirst, friction_first, position);
        save(point.core_a, core_a);
        save(point.core_b, core_b);
        save(point.radius_a, radius_a);
        save(point.radius_b, radius_b);
        save(point.is_used, select(used, all(1), all(0)));
        save(warm.position, scale * position);
        save(warm.velocity, scale * velocity);
        s.total[batch.first + i] = {};
        if (batch.friction < 0) {
            for (int j = 0; j < 2; ++j) warm.friction[j] = warm.friction_first[j] = {};
            continue;
        }
        const Vec r_a = a.R * core_a - radius_a * n, r_b = between + r_a;
        const Vec v = (u.va + cross(u.wa, r_a)) - (u.vb + cross(u.wb, r_b));
        const Vec nothing = {all(0), all(0), all(0)};
        const Vec t1 = select(used & rubs, first_tangent(s, v - dot(n, v) * n, pull, previous, n), nothing), t2 = cross(n, t1);
        const V4 bears1 = scale * dot(t1, friction), bears2 = scale * dot(t2, friction);
        const M4 bears = (bears1 != 0) | (bears2 != 0);
        WideFriction* rows_of_point = &s.frictions[batch.friction + 2 * i];
        save(rows_of_point[0].t, t1);
        save(rows_of_point[1].t, t2);
        save(warm.friction[0], bears1);
        save(warm.friction[1], bears2);
        save(warm.friction_first[0], select(bears, scale * dot(t1, friction_first), all(0)));
        save(warm.friction_first[1], select(bears, scale * dot(t2, friction_first), all(0)));
        scatter_row(build, i, kStateTangent, select(rubs, t1, previous), separation);
    }
}

static void build(const WideView& s, int begin, int end) {
    for (int k = begin; k < end; ++k) {
        if (k + kLoadAhead < end) prefetch_states(s.builds[k + kLoadAhead]);
        const BatchPose a = pose_of(s, s.batches[k].a), b = pose_of(s, s.batches[k].b);
        load_batch(s, k, a, b);
        build_rows(s, k, AllLanes{}, a, b);
    }
}

// Signs of zeros are dropped: which one a zero has may depend on what else is in its batch.
static void store(const WideView& s, int begin, int end, double warm_scale) {
    const V4 scale = all(warm_scale), zero = all(0);
    for (int k = begin; k < end; ++k) {
        if (k + kLoadAhead < end) prefetch_states(s.builds[k + kLoadAhead]);
        const WideBatch& batch = s.batches[k];
        const WideBatchBuild& build = s.builds[k];
        for (int i = 0; i < batch.count; ++i) {
            const WideWarm& warm = s.warm[batch.first + i];
            const WideImpulse& total = s.total[batch.first + i];
            Vec t1 = {zero, zero, zero}, t2 = t1;
            if (batch.friction >= 0) {
                t1 = load(s.frictions[batch.friction + 2 * i].t);
                t2 = load(s.frictions[batch.friction + 2 * i + 1].t);
            }
            const Vec friction = (scale * load(warm.friction[0])) * t1 + (scale * load(warm.friction[1])) * t2;
            const Vec first = (scale * load(warm.friction_first[0])) * t1 + (scale * load(warm.friction_first[1])) * t2;
            const Vec nothing = {zero, zero, zero};
            scatter_row(build, i, kStateFriction, friction + nothing, scale * load(warm.velocity) + zero);
            scatter_row(build, i, kStateFrictionFirst, first + nothing, scale * load(warm.position) + zero);
            for (int l = 0; l < kLanes; ++l) {
                if (i >= build.counts[l]) continue;
                double* sums = build.states[l] + i * kStateStride + kStateTotal;
                sums[0] = total.normal.lane[l] + 0.0;
                for (int j = 0; j < 2; ++j) sums[1 + j] = total.friction[j].lane[l] + 0.0;
            }
        }
    }
}

}  // namespace CAIRN_WIDE_SET
}  // namespace cairn
