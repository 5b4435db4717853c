// The kernels of solver/tree_contacts.hpp. Internal; compiled once for each instruction set (wide_math.hpp).
#pragma once

#include "solver/tree_data.hpp"
#include "solver/wide_math.hpp"

namespace cairn {
namespace CAIRN_WIDE_SET {

// Normal and tangents of a side's force, a lane each, and their moments about O.
struct TreeForce {
    V4 f[6];
};

CAIRN_WIDE_INLINE Vec lanes_of(const double* const* p) {
    return {V4{p[0][0], p[1][0], p[2][0], 0}, V4{p[0][1], p[1][1], p[2][1], 0}, V4{p[0][2], p[1][2], p[2][2], 0}};
}

CAIRN_WIDE_INLINE TreeForce force_at(const double* arm, const Vec& direction, const Vec& ang, V4 sign) {
    const Vec c{all(arm[0]), all(arm[1]), all(arm[2])};
    const Vec d = sign * direction, m = sign * ang + cross(c, d);
    return {{d.x, d.y, d.z, m.x, m.y, m.z}};
}

// ỹ of one node into the rows, and what is left of the force for the next.
template <int K, bool Triangle = false>
CAIRN_WIDE_INLINE void pass(const TreePart& part, TreeForce& F, V4& norm, double& across, double* values, int stride, int rows) {
    V4 y[K];
    for (int d = 0; d < K; ++d) {
        const double* S = part.S + 6 * d;
        y[d] = S[0] * F.f[0];
        for (int i = 1; i < (Triangle ? d + 1 : 6); ++i) y[d] += S[i] * F.f[i];
        norm += y[d] * y[d];
        across += y[d][1] * y[d][2];
        double* out = values + part.at + d;
        out[0] = y[d][0];
        if (rows == 1) continue;
        out[stride] = y[d][1];
        out[2 * stride] = y[d][2];
    }
    if (K % 2 == 1)
        for (int r = 0; r < rows; ++r) values[r * stride + part.at + K] = 0;
    if (part.is_top) return;
    for (int d = 0; d < K; ++d)
        for (int i = 0; i < 6; ++i) F.f[i] -= part.U[6 * d + i] * y[d];
}

static void build_tree_point(const TreeBlock& block, const TreePart* parts, const TreePoint& point, double* values, TreeRow* rows) {
    const int stride = kTreePad * block.quads, count = block.has_friction ? kTreeRowsAPoint : 1;
    const Vec direction = lanes_of(point.direction);
    TreeForce F[2];
    if (block.arm_a) F[0] = force_at(block.arm_a, direction, lanes_of(point.ang_a), all(1));
    if (block.arm_b) F[1] = force_at(block.arm_b, direction, lanes_of(point.ang_b), all(-1));
    V4 norm = all(0);
    double across = 0;
    for (int p = block.part_begin; p < block.part_end; ++p) {
        const TreePart& part = parts[p];
        TreeForce& own = F[part.side];
        if (part.meets)
            for (int i = 0; i < 6; ++i) own.f[i] += F[1 - part.side].f[i];
        switch (part.dofs) {
            case 0:
                break;
            case 1:
                pass<1>(part, own, norm, across, values, stride, count);
                break;
            case 3:
                pass<3>(part, own, norm, across, values, stride, count);
                break;
            case 5:
                pass<5>(part, own, norm, across, values, stride, count);
                break;
            default:  // a body that moves freely
                pass<6, true>(part, own, norm, across, values, stride, count);
        }
    }
    for (int r = 0; r < count && block.is_padded; ++r) values[r * stride + stride - 2] = values[r * stride + stride - 1] = 0;
    // Joints may leave both tangents the same way to go; two rows that are solved side by side would then go it
    // twice, and back. Up to a correlation of ½ they meet without help.
    const double least = norm[1] < norm[2] ? norm[1] : norm[2], twice = 2 * (across < 0 ? -across : across);
    const double shared = twice > least ? twice - least : 0;
    for (int r = 0; r < count; ++r) {
        rows[r].inv_mass = norm[r] + point.softness[r] + (r > 0 ? shared : 0);
        rows[r].mass = 1 / rows[r].inv_mass;
    }
}

CAIRN_WIDE_INLINE double sum(V4 p) {
    const V2 s = __builtin_shufflevector(p, p, 0, 1) + __builtin_shufflevector(p, p, 2, 3);
    return s[0] + s[1];
}
CAIRN_WIDE_INLINE V4 row_at(const double* y, int q) {
    return *reinterpret_cast<const V4Unaligned*>(y + 4 * q);
}
CAIRN_WIDE_INLINE double along(const double* y, const V4* z, int quads) {
    V4 p = row_at(y, 0) * z[0];
    for (int q = 1; q < quads; ++q) p += row_at(y, q) * z[q];
    return sum(p);
}
CAIRN_WIDE_INLINE void move(const TreeRow& row, const double* y, double& lambda, double next, V4* z, int quads, double& change, bool& any) {
    const double delta = next - lambda;
    if (delta == 0) return;
    any = true;
    lambda = next;
    const V4 d = all(delta);
    for (int q = 0; q < quads; ++q) z[q] += d * row_at(y, q);
    const double moved = (delta < 0 ? -delta : delta) * row.inv_mass;
    change = change < moved ? moved : change;
}
CAIRN_WIDE_INLINE double clamp(double x, double limit) {
    return x < -limit ? -limit : limit < x ? limit : x;
}

// One block, its part of z in `z`.
CAIRN_WIDE_INLINE void sweep_rows(const TreeSweep& s, const TreeBlock& block, bool with_friction, V4* z, int quads, double& change,
                                  bool& any) {
    const int rows_a_point = block.has_friction ? kTreeRowsAPoint : 1, length = kTreePad * quads;
    const TreeRow* rows = s.rows + block.row;
    const double* values = s.values + block.values;
    double* impulses = s.impulses + 3 * block.point;
    for (int i = 0; i < block.count; ++i) {
        const TreeRow& row = rows[rows_a_point * i];
        const double* y = values + rows_a_point * length * i;
        double& lambda = impulses[3 * i];
        const double next = lambda - row.mass * (along(y, z, quads) - row.aim);
        move(row, y, lambda, next < 0 ? 0 : next, z, quads, change, any);
    }
    if (!with_friction || !block.has_friction) return;
    for (int i = 0; i < block.count; ++i) {
        double* impulse = impulses + 3 * i;
        const double limit = block.mu * impulse[0];
        if (limit == 0 && impulse[1] == 0 && impulse[2] == 0) continue;
        // Side by side, as in solver/contact_rows.cpp.
        const TreeRow &row1 = rows[3 * i + 1], &row2 = rows[3 * i + 2];
        const double *y1 = values + length * (3 * i + 1), *y2 = y1 + length;
        const double v1 = along(y1, z, quads) - row1.aim, v2 = along(y2, z, quads) - row2.aim;
        const double next1 = clamp(impulse[1] - row1.mass * v1, limit), next2 = clamp(impulse[2] - row2.mass * v2, limit);
        move(row1, y1, impulse[1], next1, z, quads, change, any);
        move(row2, y2, impulse[2], next2, z, quads, change, any);
    }
}

CAIRN_WIDE_INLINE void sweep_block(const TreeSweep& s, const TreeBlock& block, bool with_friction, V4* z, int quads, double& change) {
    const int* pairs = s.pairs + block.pair;
    for (int q = 0; q < quads; ++q) {
        const V2 low = *reinterpret_cast<const V2*>(s.z + pairs[2 * q]), high = *reinterpret_cast<const V2*>(s.z + pairs[2 * q + 1]);
        z[q] = __builtin_shufflevector(low, high, 0, 1, 2, 3);
    }
    bool any = false;
    sweep_rows(s, block, with_friction, z, quads, change, any);
    if (!any) return;
    for (int q = 0; q < quads; ++q) {
        *reinterpret_cast<V2*>(s.z + pairs[2 * q]) = __builtin_shufflevector(z[q], z[q], 0, 1);
        *reinterpret_cast<V2*>(s.z + pairs[2 * q + 1]) = __builtin_shufflevector(z[q], z[q], 2, 3);
    }
}
template <int Q>
CAIRN_WIDE_INLINE void sweep_short(const TreeSweep& s, const TreeBlock& block, bool with_friction, double& change) {
    V4 z[Q];
    sweep_block(s, block, with_friction, z, Q, change);
}

static double sweep_tree(const TreeSweep& s, bool with_friction) {
    double change = 0;
    for (int k = 0; k < s.block_count; ++k) {
        const TreeBlock& block = s.blocks[k];
        switch (block.quads) {
            case 2:
                sweep_short<2>(s, block, with_friction, change);
                break;
            case 3:
                sweep_short<3>(s, block, with_friction, change);
                break;
            case 4:
                sweep_short<4>(s, block, with_friction, change);
                break;
            default:
                sweep_block(s, block, with_friction, reinterpret_cast<V4*>(s.scratch), block.quads, change);
        }
    }
    return change;
}

}  // namespace CAIRN_WIDE_SET
}  // namespace cairn
