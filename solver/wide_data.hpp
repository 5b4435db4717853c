// Contact rows of four blocks at a time: the layout that the wide kernels sweep (solver/wide_contacts.hpp says what they are for).
//
// A batch holds up to four blocks that share no dynamic body, one per lane; a point of a batch is the i-th point of each of them. Lanes
// and points that stand for nothing have mass 0, so their impulses stay 0. Equations, signs and units are those of contact_rows.hpp.
// Plain doubles: nothing here depends on the instruction set that a file is compiled for.
#pragma once

namespace cairn {

constexpr int kLanes = 4;

struct alignas(32) Wide {
    double lane[kLanes];
};

struct WideVec {
    Wide x, y, z;
};

// Angular parts of G and of M⁻¹ Gᵀ, and 1 / S.
struct WideRow {
    WideVec ang_a, ang_b, iang_a, iang_b;
    Wide mass;
};

struct WideNormal : WideRow {
    Wide target;  // [m/s], of the running solve
};

struct WideFriction : WideRow {
    WideVec t;
};

// What a sweep needs of a batch besides its rows.
struct WideBatch {
    WideVec n;
    Wide inv_mass_sum, share_a, share_b, mu, max_inv_mass;
    int a[kLanes], b[kLanes];  // bodies
    int first;                 // of its points
    int count;
    int friction;      // first of its 2·count friction rows, −1: frictionless
    unsigned moves_a;  // bit l: body a of lane l is dynamic
    unsigned moves_b;
};

// The state of a point that outlasts a step (PointState in solver/point_state.hpp), in doubles: where its rows of four begin.
constexpr int kStateStride = 24;
constexpr int kStateCoreA = 0, kStateCoreB = 4;               // and the radius of each
constexpr int kStateTangent = 8;                              // and the separation
constexpr int kStateFriction = 12, kStateFrictionFirst = 16;  // and the warm impulse of the second, and of the first solve
constexpr int kStateTotal = 20;                               // normal, friction, feature

// What rows are built from.
struct WideBatchBuild {
    WideVec n_local;
    Wide turns_with_a, turns_with_b;  // 1 or 0: the frame of n_local
    Wide built_turn_a, built_turn_b;
    double* states[kLanes];       // of each lane's first point, in the manifold cache
    const double* posed[kLanes];  // the same in the frames of the solver's bodies
    int counts[kLanes];           // points
};

struct WidePoint {
    WideVec core_a, core_b;
    Wide radius_a, radius_b;
    Wide is_used;  // 1 or 0
    Wide separation, curvature;
};

struct WideImpulse {
    Wide normal, friction[2];
};

struct WideWarm {
    Wide position, velocity, friction[2], friction_first[2];
};

// A body where rows are built: columns of R and of I⁻¹ in World, in rows of four doubles.
struct WidePose {
    double x[3], inv_mass;
    double R0[3], turned;
    double R1[3], acceleration_x;  // 0 of what cannot move
    double R2[3], acceleration_y;
    double I0[3], acceleration_z;
    double I1[3], unused1;
    double I2[3], unused2;
};

constexpr int kVelocityStride = 8;

// PointLoad, as far as the kernels need it.
struct WideLoad {
    double dt, warm_scale;
    bool fixed_tangents;
};

// Everything that a kernel works on. Impulses of normal rows and of friction rows lie apart: the first solve and the push need no others.
struct WideView {
    WideBatch* batches;
    WideBatchBuild* builds;
    WideNormal* normals;      // size p
    WideFriction* frictions;  // size f
    WidePoint* points;        // size p
    Wide* normal_impulse;     // size p
    Wide* friction_impulse;   // size f
    Wide* normal_held;        // size p: where the first solve ended
    Wide* friction_held;      // size f
    WideWarm* warm;           // size p
    WideImpulse* total;       // size p
    double* velocity;         // (v, w) of each body, in kVelocityStride doubles: BodyVelocity
    const WidePose* poses;    // of each body
    WideLoad load;
};

// The stages of a substep (names and meaning as in contact_rows.hpp) over the batches [begin, end), for one instruction set. Every set
// gives the same bits.
struct WideKernel {
    const char* name;
    void (*build)(const WideView&, int begin,
                  int end);  // points from their states, and all rows, at the start of a step; normals are there
    void (*start_first)(const WideView&, int begin, int end, double h);  // sets the targets of the gaps, too
    double (*sweep_normals)(const WideView&, int begin, int end);
    double (*sweep_velocities)(const WideView&, int begin, int end);
    void (*hold)(const WideView&, int begin, int end, double h, double rate);  // sets the targets of the push, too
    void (*push)(const WideView&, int begin, int end);
    void (*advance)(const WideView&, int begin, int end, double h, double tolerance);
    void (*start_second)(const WideView&, int begin, int end);  // release and warm start; sets the targets of the velocities, too
    void (*close)(const WideView&, int begin, int end);
    void (*store)(const WideView&, int begin, int end, double warm_scale);  // impulses, to the states
};

extern const WideKernel kPortableWideKernel;
extern const WideKernel kAvx2WideKernel;  // in programs for x86-64 alone

}  // namespace cairn
