// Four doubles at a time, for the wide kernels alone: GCC's and Clang's vector types, which become whatever the file's instruction set has.
// Each operation is one IEEE operation a lane, in the order of the scalar code, so the bits are the same on every set and those of the
// scalar rows.
//
// A file that is compiled for a wider set than the program includes nothing else but wide_data.hpp: an inline function of the standard
// library, compiled here, could be the copy that the linker keeps for all.
#pragma once

#include "solver/wide_data.hpp"

#ifndef CAIRN_WIDE_SET
#define CAIRN_WIDE_SET portable
#endif

#define CAIRN_WIDE_INLINE [[gnu::always_inline]] static inline

namespace cairn {
namespace CAIRN_WIDE_SET {

typedef double V4 __attribute__((vector_size(32), may_alias));
typedef double V4Unaligned __attribute__((vector_size(32), aligned(8), may_alias));
typedef double V2 __attribute__((vector_size(16), may_alias));
typedef double V2Unaligned __attribute__((vector_size(16), aligned(8), may_alias));
typedef long long M4 __attribute__((vector_size(32), may_alias));

struct Vec {
    V4 x, y, z;
};

CAIRN_WIDE_INLINE V4 all(double s) {
    return V4{s, s, s, s};
}
CAIRN_WIDE_INLINE V4 load(const Wide& w) {
    return *reinterpret_cast<const V4*>(&w);
}
CAIRN_WIDE_INLINE void save(Wide& w, V4 v) {
    *reinterpret_cast<V4*>(&w) = v;
}
CAIRN_WIDE_INLINE Vec load(const WideVec& w) {
    return {load(w.x), load(w.y), load(w.z)};
}
CAIRN_WIDE_INLINE void save(WideVec& w, const Vec& v) {
    save(w.x, v.x);
    save(w.y, v.y);
    save(w.z, v.z);
}

CAIRN_WIDE_INLINE V4 select(M4 mask, V4 yes, V4 no) {
    return mask ? yes : no;
}
CAIRN_WIDE_INLINE Vec select(M4 mask, const Vec& yes, const Vec& no) {
    return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}
// As std::max and std::min do it.
CAIRN_WIDE_INLINE V4 larger(V4 a, V4 b) {
    return select(a < b, b, a);
}
CAIRN_WIDE_INLINE V4 smaller(V4 a, V4 b) {
    return select(b < a, b, a);
}
CAIRN_WIDE_INLINE V4 magnitude(V4 a) {
    return select(a < 0, -a, a);
}
CAIRN_WIDE_INLINE V4 root(V4 a) {
    return V4{__builtin_sqrt(a[0]), __builtin_sqrt(a[1]), __builtin_sqrt(a[2]), __builtin_sqrt(a[3])};
}
CAIRN_WIDE_INLINE bool any(M4 mask) {
    return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
}
CAIRN_WIDE_INLINE double largest(V4 a) {
    double m = a[0];
    for (int l = 1; l < kLanes; ++l) m = m < a[l] ? a[l] : m;
    return m;
}

CAIRN_WIDE_INLINE Vec operator+(const Vec& a, const Vec& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
CAIRN_WIDE_INLINE Vec operator-(const Vec& a, const Vec& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
CAIRN_WIDE_INLINE Vec operator*(V4 s, const Vec& a) {
    return {s * a.x, s * a.y, s * a.z};
}
CAIRN_WIDE_INLINE V4 dot(const Vec& a, const Vec& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
CAIRN_WIDE_INLINE Vec cross(const Vec& a, const Vec& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// By columns. The sum of the third row is taken from the right, as Eigen takes it.
struct Mat {
    Vec c0, c1, c2;
};
CAIRN_WIDE_INLINE Vec operator*(const Mat& m, const Vec& v) {
    return {m.c0.x * v.x + m.c1.x * v.y + m.c2.x * v.z, m.c0.y * v.x + m.c1.y * v.y + m.c2.y * v.z,
            m.c0.z * v.x + (m.c1.z * v.y + m.c2.z * v.z)};
}

// Rows of four doubles, one from each lane's address, to four wide numbers.
CAIRN_WIDE_INLINE void transpose(V4& r0, V4& r1, V4& r2, V4& r3) {
    const V4 a = __builtin_shufflevector(r0, r1, 0, 4, 2, 6), b = __builtin_shufflevector(r0, r1, 1, 5, 3, 7);
    const V4 c = __builtin_shufflevector(r2, r3, 0, 4, 2, 6), d = __builtin_shufflevector(r2, r3, 1, 5, 3, 7);
    r0 = __builtin_shufflevector(a, c, 0, 1, 4, 5);
    r1 = __builtin_shufflevector(b, d, 0, 1, 4, 5);
    r2 = __builtin_shufflevector(a, c, 2, 3, 6, 7);
    r3 = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}
CAIRN_WIDE_INLINE void gather4(const double* l0, const double* l1, const double* l2, const double* l3, Vec& v, V4& fourth) {
    v.x = *reinterpret_cast<const V4Unaligned*>(l0);
    v.y = *reinterpret_cast<const V4Unaligned*>(l1);
    v.z = *reinterpret_cast<const V4Unaligned*>(l2);
    fourth = *reinterpret_cast<const V4Unaligned*>(l3);
    transpose(v.x, v.y, v.z, fourth);
}

// (v, w) of four bodies: six doubles each.
CAIRN_WIDE_INLINE void gather_velocity(const double* velocity, const int* body, Vec& v, Vec& w) {
    const double *l0 = velocity + kVelocityStride * body[0], *l1 = velocity + kVelocityStride * body[1];
    const double *l2 = velocity + kVelocityStride * body[2], *l3 = velocity + kVelocityStride * body[3];
    gather4(l0, l1, l2, l3, v, w.x);
    const V2 q0 = *reinterpret_cast<const V2Unaligned*>(l0 + 4), q1 = *reinterpret_cast<const V2Unaligned*>(l1 + 4);
    const V2 q2 = *reinterpret_cast<const V2Unaligned*>(l2 + 4), q3 = *reinterpret_cast<const V2Unaligned*>(l3 + 4);
    const V2 y01 = __builtin_shufflevector(q0, q1, 0, 2), y23 = __builtin_shufflevector(q2, q3, 0, 2);
    const V2 z01 = __builtin_shufflevector(q0, q1, 1, 3), z23 = __builtin_shufflevector(q2, q3, 1, 3);
    w.y = __builtin_shufflevector(y01, y23, 0, 1, 2, 3);
    w.z = __builtin_shufflevector(z01, z23, 0, 1, 2, 3);
}
CAIRN_WIDE_INLINE void scatter_velocity(double* velocity, const int* body, unsigned moves, const Vec& v, const Vec& w) {
    V4 r0 = v.x, r1 = v.y, r2 = v.z, r3 = w.x;
    transpose(r0, r1, r2, r3);
    const V4 low = __builtin_shufflevector(w.y, w.z, 0, 4, 2, 6), high = __builtin_shufflevector(w.y, w.z, 1, 5, 3, 7);
    const auto put = [&](int lane, const V4& head, const V2& tail) __attribute__((always_inline)) {
        if (!(moves >> lane & 1)) return;
        double* p = velocity + kVelocityStride * body[lane];
        *reinterpret_cast<V4Unaligned*>(p) = head;
        *reinterpret_cast<V2Unaligned*>(p + 4) = tail;
    };
    put(0, r0, __builtin_shufflevector(low, low, 0, 1));
    put(1, r1, __builtin_shufflevector(high, high, 0, 1));
    put(2, r2, __builtin_shufflevector(low, low, 2, 3));
    put(3, r3, __builtin_shufflevector(high, high, 2, 3));
}

}  // namespace CAIRN_WIDE_SET
}  // namespace cairn
