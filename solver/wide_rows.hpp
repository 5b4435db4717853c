// The wide kernels' stages that change velocities and impulses. Internal; compiled once for each instruction set (wide_math.hpp).
#pragma once

#include "solver/wide_math.hpp"

namespace cairn {
namespace CAIRN_WIDE_SET {

constexpr double kInfinite = __builtin_inf();

// Velocities of a batch's bodies, as BlockVelocity has them.
struct BatchVelocity {
    Vec va, vb, dv, wa, wb;
};

CAIRN_WIDE_INLINE BatchVelocity velocity_of(const WideView& s, const WideBatch& batch) {
    BatchVelocity u;
    gather_velocity(s.velocity, batch.a, u.va, u.wa);
    gather_velocity(s.velocity, batch.b, u.vb, u.wb);
    u.dv = u.va - u.vb;
    return u;
}

CAIRN_WIDE_INLINE void store_velocity(const WideView& s, const WideBatch& batch, const BatchVelocity& u) {
    const Vec change = u.dv - (u.va - u.vb);
    scatter_velocity(s.velocity, batch.a, batch.moves_a, u.va + load(batch.share_a) * change, u.wa);
    scatter_velocity(s.velocity, batch.b, batch.moves_b, u.vb - load(batch.share_b) * change, u.wb);
}

CAIRN_WIDE_INLINE V4 along(const BatchVelocity& u, const Vec& direction, const WideRow& row) {
    return dot(direction, u.dv) + dot(load(row.ang_a), u.wa) - dot(load(row.ang_b), u.wb);
}

CAIRN_WIDE_INLINE void apply(BatchVelocity& u, const WideBatch& batch, const Vec& direction, const WideRow& row, V4 lambda) {
    u.dv = u.dv + (load(batch.inv_mass_sum) * lambda) * direction;
    u.wa = u.wa + lambda * load(row.iang_a);
    u.wb = u.wb - lambda * load(row.iang_b);
}

CAIRN_WIDE_INLINE V4 gap_target(const WidePoint& p, double h, double rate) {
    const V4 gap = load(p.separation) + all(0.5 * h * h) * load(p.curvature);
    return select(gap > 0, -gap / all(h), all(-rate) * gap / all(h));
}

static void start_first(const WideView& s, int begin, int end, double h) {
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        BatchVelocity u = velocity_of(s, batch);
        const Vec n = load(batch.n);
        for (int i = 0; i < batch.count; ++i) {
            const int p = batch.first + i;
            WideNormal& row = s.normals[p];
            save(row.target, gap_target(s.points[p], h, 0));
            const V4 normal = load(s.warm[p].position);
            save(s.normal_impulse[p], normal);
            apply(u, batch, n, row, normal);
            for (int j = 0; j < 2 && batch.friction >= 0; ++j) {
                const int f = batch.friction + 2 * i + j;
                const V4 friction = load(s.warm[p].friction_first[j]);
                save(s.friction_impulse[f], friction);
                apply(u, batch, load(s.frictions[f].t), s.frictions[f], friction);
            }
        }
        store_velocity(s, batch, u);
    }
}

CAIRN_WIDE_INLINE V4 sweep_batch_normals(const WideView& s, const WideBatch& batch, BatchVelocity& u) {
    V4 change = all(0);
    const Vec n = load(batch.n);
    for (int p = batch.first; p < batch.first + batch.count; ++p) {
        const WideNormal& row = s.normals[p];
        const V4 lambda = load(s.normal_impulse[p]);
        const V4 next = larger(lambda - load(row.mass) * (along(u, n, row) - load(row.target)), all(0));
        const V4 delta = next - lambda;
        save(s.normal_impulse[p], next);
        apply(u, batch, n, row, delta);
        change = larger(change, magnitude(delta));
    }
    return change;
}

// The two rows of a point side by side.
CAIRN_WIDE_INLINE V4 sweep_batch_friction(const WideView& s, const WideBatch& batch, BatchVelocity& u) {
    V4 change = all(0);
    for (int i = 0; i < batch.count; ++i) {
        const int f = batch.friction + 2 * i;
        const V4 limit = load(batch.mu) * load(s.normal_impulse[batch.first + i]);
        const V4 old1 = load(s.friction_impulse[f]), old2 = load(s.friction_impulse[f + 1]);
        if (!any((limit != 0) | (old1 != 0) | (old2 != 0))) continue;
        const WideFriction &row1 = s.frictions[f], &row2 = s.frictions[f + 1];
        const Vec t1 = load(row1.t), t2 = load(row2.t);
        const V4 next1 = smaller(larger(old1 - load(row1.mass) * along(u, t1, row1), -limit), limit);
        const V4 next2 = smaller(larger(old2 - load(row2.mass) * along(u, t2, row2), -limit), limit);
        save(s.friction_impulse[f], next1);
        save(s.friction_impulse[f + 1], next2);
        apply(u, batch, t1, row1, next1 - old1);
        apply(u, batch, t2, row2, next2 - old2);
        change = larger(change, larger(magnitude(next1 - old1), magnitude(next2 - old2)));
    }
    return change;
}

static double sweep_normals(const WideView& s, int begin, int end) {
    V4 most = all(0);
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        BatchVelocity u = velocity_of(s, batch);
        most = larger(most, sweep_batch_normals(s, batch, u) * load(batch.max_inv_mass));
        store_velocity(s, batch, u);
    }
    return largest(most);
}

// As push_evenly in contact_rows.cpp. Lanes of one point are left to their row.
CAIRN_WIDE_INLINE void push_evenly(const WideView& s, const WideBatch& batch, BatchVelocity& u) {
    const Vec n = load(batch.n);
    WideRow sum = {};
    V4 count = all(0), lack = all(0), least = all(kInfinite);
    const auto add = [](WideVec& to, const WideVec& from, V4 used) { save(to, load(to) + used * load(from)); };
    for (int p = batch.first; p < batch.first + batch.count; ++p) {
        const WideNormal& row = s.normals[p];
        const V4 used = load(s.points[p].is_used);
        add(sum.ang_a, row.ang_a, used);
        add(sum.ang_b, row.ang_b, used);
        add(sum.iang_a, row.iang_a, used);
        add(sum.iang_b, row.iang_b, used);
        lack = lack + used * (load(row.target) - along(u, n, row));
        least = smaller(least, select(used != 0, load(s.normal_impulse[p]), all(kInfinite)));
        count = count + used;
    }
    const M4 several = count > 1;
    if (!any(several)) return;
    const V4 S = count * count * load(batch.inv_mass_sum) + dot(load(sum.ang_a), load(sum.iang_a)) + dot(load(sum.ang_b), load(sum.iang_b));
    const V4 lambda = select(several, larger(lack / S, -least), all(0));
    for (int p = batch.first; p < batch.first + batch.count; ++p)
        save(s.normal_impulse[p], load(s.normal_impulse[p]) + load(s.points[p].is_used) * lambda);
    apply(u, batch, count * n, sum, lambda);
}

static void push(const WideView& s, int begin, int end) {
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        BatchVelocity u = velocity_of(s, batch);
        if (batch.count > 1) push_evenly(s, batch, u);
        sweep_batch_normals(s, batch, u);
        store_velocity(s, batch, u);
    }
}

static double sweep_velocities(const WideView& s, int begin, int end) {
    V4 most = all(0);
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        BatchVelocity u = velocity_of(s, batch);
        V4 change = sweep_batch_normals(s, batch, u);
        if (batch.friction >= 0) change = larger(change, sweep_batch_friction(s, batch, u));
        most = larger(most, change * load(batch.max_inv_mass));
        store_velocity(s, batch, u);
    }
    return largest(most);
}

// Lanes without any normal impulse give back the friction of their warm start.
CAIRN_WIDE_INLINE void return_warm_friction(const WideView& s, const WideBatch& batch) {
    M4 bears = all(0) > 0;
    for (int i = 0; i < batch.count; ++i) bears = bears | (load(s.normal_impulse[batch.first + i]) > 0);
    M4 returns = all(0) > 0;
    for (int f = batch.friction; f < batch.friction + 2 * batch.count; ++f)
        returns = returns | (~bears & (load(s.friction_impulse[f]) != 0));
    if (!any(returns)) return;
    BatchVelocity u = velocity_of(s, batch);
    for (int f = batch.friction; f < batch.friction + 2 * batch.count; ++f) {
        const V4 friction = load(s.friction_impulse[f]);
        apply(u, batch, load(s.frictions[f].t), s.frictions[f], select(bears, all(0), -friction));
        save(s.friction_impulse[f], select(bears, friction, all(0)));
    }
    store_velocity(s, batch, u);
}

static void hold(const WideView& s, int begin, int end, double h, double rate) {
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        if (batch.friction >= 0) return_warm_friction(s, batch);
        for (int i = 0; i < batch.count; ++i) {
            const int p = batch.first + i;
            s.normal_held[p] = s.normal_impulse[p];
            save(s.normals[p].target, gap_target(s.points[p], h, rate));
            for (int j = 0; j < 2 && batch.friction >= 0; ++j) {
                const int f = batch.friction + 2 * i + j;
                s.friction_held[f] = s.friction_impulse[f];
            }
        }
    }
}

static void start_second(const WideView& s, int begin, int end) {
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        BatchVelocity u = velocity_of(s, batch);
        const Vec n = load(batch.n);
        for (int i = 0; i < batch.count; ++i) {
            const int p = batch.first + i;
            const WidePoint& point = s.points[p];
            WideNormal& row = s.normals[p];
            // After the drift: what does not touch is not held.
            const M4 touching = (load(s.normal_impulse[p]) > 0) | (load(point.separation) <= 0);
            save(row.target, select(touching | (load(point.is_used) == 0), all(0), all(-kInfinite)));
            const V4 held = load(s.normal_held[p]), normal = larger(load(s.warm[p].velocity), -held);
            save(s.normal_impulse[p], held + normal);
            apply(u, batch, n, row, normal);
            for (int j = 0; j < 2 && batch.friction >= 0; ++j) {
                const int f = batch.friction + 2 * i + j;
                const V4 friction = load(s.warm[p].friction[j]) - load(s.warm[p].friction_first[j]);
                save(s.friction_impulse[f], load(s.friction_held[f]) + friction);
                apply(u, batch, load(s.frictions[f].t), s.frictions[f], friction);
            }
        }
        store_velocity(s, batch, u);
    }
}

static void close(const WideView& s, int begin, int end) {
    for (int k = begin; k < end; ++k) {
        const WideBatch& batch = s.batches[k];
        for (int i = 0; i < batch.count; ++i) {
            const int p = batch.first + i;
            WideWarm& warm = s.warm[p];
            WideImpulse& total = s.total[p];
            const V4 normal = load(s.normal_impulse[p]);
            warm.position = s.normal_held[p];
            save(warm.velocity, normal - load(s.normal_held[p]));
            save(total.normal, load(total.normal) + normal);
            for (int j = 0; j < 2 && batch.friction >= 0; ++j) {
                const V4 friction = load(s.friction_impulse[batch.friction + 2 * i + j]);
                save(warm.friction[j], friction);
                save(warm.friction_first[j], all(0.5) * friction);
                save(total.friction[j], load(total.friction[j]) + friction);
            }
        }
    }
}

}  // namespace CAIRN_WIDE_SET
}  // namespace cairn
