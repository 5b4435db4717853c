// Contact rows: non-penetration and pyramidal friction, in pools.
//
// A block is one manifold: bodies A and B, unit normal n from B to A, up to four points. Per point, with r_A, r_B the arms from the centres
// of mass:
//     normal    C = nᵀ(x_A + r_A − x_B − r_B) >= 0    G = [nᵀ, (r_A × n)ᵀ, −nᵀ, −(r_B × n)ᵀ]    λ_N >= 0
//     friction  along the tangent t: G with t for n, −μ λ_N <= α <= μ λ_N, two rows per point, t₂ = n × t₁ (pyramid)
//     S = G M⁻¹ Gᵀ = 1/m_A + 1/m_B + (r_A × n)ᵀ I_A⁻¹ (r_A × n) + (r_B × n)ᵀ I_B⁻¹ (r_B × n)
// All in World. Impulses in N s; +λ acts on A. Sources: Baraff 1997; Catto 2005 (accumulated impulses), 2014 (substeps with soft rows).
#pragma once

#include "solver/body.hpp"
#include "solver/point_state.hpp"

#include <cstdint>
#include <vector>

namespace cairn {

// Jacobian of one scalar contact or friction row and what follows from it. The linear part is ±n (or ±t) and lives in the block.
struct PointRow {
    Vec3 ang_a = Vec3::Zero();   // r_A × n
    Vec3 ang_b = Vec3::Zero();   // r_B × n (enters G with a minus)
    Vec3 iang_a = Vec3::Zero();  // I_A⁻¹ (r_A × n)
    Vec3 iang_b = Vec3::Zero();
    Real mass = 0;  // 1 / S [kg]; 0 where neither body can move
};

// G M⁻¹ Gᵀ and the parts of M⁻¹ Gᵀ of a row along `direction` at arms r_a, r_b.
PointRow make_point_row(const Vec3& direction, const Vec3& r_a, const Vec3& r_b, const BodyMotion& a, const BodyMotion& b);

struct NormalRow : PointRow {
    Real separation = 0;  // [m], C at the current poses
    // [m/s²], Ġ v: what the linear prediction of C misses is h²/2 of it. Only the centripetal acceleration of the core points of a body
    // that does not own n. Left out are the owner's nᵀ(ω × (ω × r)) and the Coriolis term 2 nᵀ(ω × u) of the other body's point that slides
    // over it with u. So where the owner of n turns, a gap is predicted too wide or too narrow by h²(½ω²‖r‖ + ω‖u‖) at most, for this
    // substep alone: the next one measures it anew. (1 rad/s, 1 m, 1 m/s, h = 1/240 s: 0.03 mm.)
    Real curvature = 0;
    Real lift = 0;          // [m], separation wanted at the end of the drift (0 but for a bounce in it)
    Real held_impulse = 0;  // [N s], λ at the end of the first solve
    bool touching = true;   // at the end of the drift: penetrating, or held by the position solve
    Real bounce = 0;        // [m/s], relative normal velocity wanted after the substep (0 but for a bounce)
};

struct FrictionRow : PointRow {
    Real held_impulse = 0;   // [N s], α at the end of the first solve
    Vec3 t = Vec3::UnitX();  // unit tangent
};

// Where a point sits: material core points in the bodies' frames and round offsets along n (collision/manifold.hpp explains them).
struct PointGeometry {
    Vec3 core_a_A = Vec3::Zero();
    Vec3 core_b_B = Vec3::Zero();
    Real radius_a = 0;
    Real radius_b = 0;
    Vec3 t1 = Vec3::UnitX();  // unit tangent at the start of the step, from which friction rows take theirs
};

// The accumulated impulses of a point [N s].
struct PointImpulse {
    Real normal = 0;
    Real friction[2] = {0, 0};
};

// What a point starts the next substep with [N s]: each of the two solves from where it ended itself.
struct WarmImpulse {
    Real position = 0;                // normal, at the end of the first solve
    Real velocity = 0;                // normal, what the second solve added to it (may be negative)
    Real friction[2] = {0, 0};        // at the end of both
    Real friction_first[2] = {0, 0};  // at the end of the first, or what it is taken to bear
};

// What the normal follows within a step: nothing, a body, or (where there is restitution) the direction between the core points of the
// block's one point.
enum class NormalFrame : std::uint8_t { kWorld, kA, kB, kCores };

struct ContactBlock {
    int a = kImmovable;
    int b = kImmovable;
    int first = 0;  // of its points in the pools
    int count = 0;
    int friction = -1;             // first of its 2·count friction rows, −1: frictionless
    PointState* states = nullptr;  // of its points, in the manifold cache
    bool is_posed = false;  // a body's frame is not the solver's (what cannot move is in World): the points are in ContactPool::posed
    Vec3 n = Vec3::UnitZ();
    Vec3 n_local = Vec3::UnitZ();  // in the frame that `frame` names
    NormalFrame frame = NormalFrame::kWorld;
    Real inv_mass_a = 0;
    Real inv_mass_b = 0;
    Real mu = 0;
    Real restitution = 0;
    Real inv_mass_sum = 0;
    Real share_a = 0;  // of a linear impulse's change of relative velocity: inv_mass_a / inv_mass_sum
    Real share_b = 0;
    Real max_inv_mass = 0;  // largest S of its rows: bounds how much a change of impulse changes velocities
    Real built_turn_a = 0;  // BodyMotion::turned of the bodies when the rows were built
    Real built_turn_b = 0;
};

// Torsional and rolling friction of a block (solver/spin_rows.hpp), for the few that have any.
struct SpinRow {
    int block = 0;
    Real torsional = 0;                // c_t [m]
    Real rolling = 0;                  // c_r [m]
    Vec3 warm = Vec3::Zero();          // [N m s], of the substep before, both solves
    Vec3 impulse = Vec3::Zero();       // [N m s], of the running substep
    Vec3 total = Vec3::Zero();         // [N m s], summed over the substeps
    Mat3 response = Mat3::Identity();  // K = I_A⁻¹ + I_B⁻¹ [1/(kg m²)]
    Real torsion_mass = 0;             // 1 / nᵀKn [kg m²]
    Real rolling_mass = 0;             // 1 / the largest eigenvalue of K across n
    Real arm = 0;                      // [m], from the centres to the points: makes rates of turning velocities
};

// Pools of the contact rows of all islands; an island owns a range of blocks, a block a range of points.
struct ContactPool {
    std::vector<ContactBlock> blocks;
    std::vector<NormalRow> normals;       // size p
    std::vector<PointGeometry> geometry;  // size p
    std::vector<FrictionRow> frictions;   // 2 per point of a block with μ > 0
    std::vector<WarmImpulse> warm;        // size p: from the substep before
    std::vector<PointImpulse> impulse;    // size p: unknowns of the running substep
    std::vector<PointImpulse> total;      // size p: summed over the substeps
    std::vector<PointImpulse> before;     // size p, scratch of the reference methods
    std::vector<PointImpulse> direction;  // likewise
    std::vector<SpinRow> spins;
    std::vector<PointState> posed;  // size p, of blocks with is_posed alone
    // In use; the vectors keep their size from step to step.
    std::size_t block_count = 0;
    std::size_t point_count = 0;
    std::size_t friction_count = 0;
    void clear();
    // Grows the vectors for so many more blocks, points and friction rows.
    void make_room(std::size_t more_blocks, std::size_t points, std::size_t friction_rows);
};

// The states of a block's points, in the frames of the solver's bodies.
inline const PointState* posed_states(const ContactPool& pool, const ContactBlock& block) {
    return block.is_posed ? &pool.posed[block.first] : block.states;
}

struct BlockRange {
    int begin = 0;
    int end = 0;
};

// The points of a range of blocks that is not empty.
struct PointRange {
    int begin = 0;
    int end = 0;
    int count() const { return end - begin; }
};
PointRange points_of(const ContactPool& pool, BlockRange range);

// The normal of a block at the current poses.
void orient_normal(ContactBlock& block, const SolverBodies& bodies);

// A unit tangent: `direction` [any length] projected on the plane across n, or where that says nothing some vector of the plane.
Vec3 tangent_along(const Vec3& direction, const Vec3& n);

// Rows and separations of a block from its geometry, normal and tangents at the current poses.
void build_rows(ContactPool& pool, ContactBlock& block, const SolverBodies& bodies);

// The same for all blocks of a range, whose normals and first tangents have been set; impulses and totals start at 0.
void build_contacts(ContactPool& pool, BlockRange range, const SolverBodies& bodies);

// Rebuilds a block's rows along the normal at the current poses, and its tangents projected on the new tangent plane.
void build_block(ContactPool& pool, ContactBlock& block, const SolverBodies& bodies);

// Rebuilds the blocks whose bodies have turned by more than `tolerance` [rad] since their rows were built. The separations of the others
// are advanced by h G v (fixed arms: exact for translation, off by ‖r‖ tolerance²/2 at most).
void advance_blocks(ContactPool& pool, BlockRange range, const SolverBodies& bodies, Real h, Real tolerance);

// The largest warm impulse of a point along its normal, in one of the solves [N s].
Real largest_warm(const ContactPool& pool, BlockRange range);

// Multiplies the warm impulses, when the length of the step has changed.
void scale_warm_start(ContactPool& pool, BlockRange range, Real scale);

// Starts the first solve of a substep from its warm impulses, the second one from what it added to them, or the textbook's one solve (all
// at once).
void warm_start_first(ContactPool& pool, BlockRange range, SolverBodies& bodies);
void warm_start_second(ContactPool& pool, BlockRange range, SolverBodies& bodies);
void warm_start_all(ContactPool& pool, BlockRange range, SolverBodies& bodies);

// One Gauss-Seidel sweep over the normal rows of the first solve: over the drift of h no gap closes beyond zero (or its lift), and what
// penetrates gets no deeper. Returns a bound of the largest velocity change of a row [m/s].
Real sweep_contact_gaps(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h);

// Notes where the first solve ended, and takes back the warm friction of manifolds that ended it without normal impulse; the push that
// follows starts from there and leaves no trace in the impulses.
void hold_contacts(ContactPool& pool, BlockRange range, SolverBodies& bodies);

// One sweep of the push: velocities that move each gap to zero and each penetration by `rate` of itself within h; of each block its
// points together first, then one by one.
void push_contacts(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h, Real rate);

// After the drift: notes what touches, and sets the impulses back to where the first solve held them.
void release_contacts(ContactPool& pool, BlockRange range);

// Of what the impulses have changed by since the first solve held them, a share is kept.
void keep_impulse_share(ContactPool& pool, BlockRange range, Real share);

// One sweep over normal, then (unless another model sees to it) friction rows of the second solve: G v >= 0 (or a bounce) where it touches.
Real sweep_contact_velocities(ContactPool& pool, BlockRange range, SolverBodies& bodies, bool with_friction = true);

// What the first solve of the next substep bears of the friction of this one: half, where it does not solve for friction, or what it bore.
enum class FirstFriction : std::uint8_t { kHalf, kHeld };

// At the end of a substep: total += impulse, the warm impulses follow, impulse = 0.
void close_contact_substep(ContactPool& pool, BlockRange range, FirstFriction first);

}  // namespace cairn
