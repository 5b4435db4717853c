#include "solver/contact_kernel.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
// Sine of the least angle between a wanted tangent and the normal at which it still says a direction.
constexpr Real kLeastTangent = 1e-3;

// The friction rows of each point of a block; bounds from the accumulated normal impulses. The two rows of a point are solved side by side:
// each still sees its own velocity alone, so a sliding point's friction stays along its slip. Returns the largest change of an impulse.
Real sweep_block_friction(ContactPool& pool, const ContactBlock& block, BlockVelocity& u) {
    Real change = 0;
    for (int i = 0; i < block.count; ++i) {
        PointImpulse& impulse = pool.impulse[block.first + i];
        const Real limit = block.mu * impulse.normal;
        if (limit == 0 && impulse.friction[0] == 0 && impulse.friction[1] == 0) continue;
        const FrictionRow *row1 = &pool.frictions[block.friction + 2 * i], *row2 = row1 + 1;
        const Real next1 = std::clamp(impulse.friction[0] - row1->mass * u.along(row1->t, *row1), -limit, limit);
        const Real next2 = std::clamp(impulse.friction[1] - row2->mass * u.along(row2->t, *row2), -limit, limit);
        const Real delta1 = next1 - impulse.friction[0], delta2 = next2 - impulse.friction[1];
        impulse.friction[0] = next1;
        impulse.friction[1] = next2;
        u.apply(block, row1->t, *row1, delta1);
        u.apply(block, row2->t, *row2, delta2);
        change = std::max(change, std::max(std::abs(delta1), std::abs(delta2)));
    }
    return change;
}

// One sweep over normal rows, targets from `target_of`, and over friction rows if `with_friction`.
template <typename TargetOf>
Real sweep(ContactPool& pool, BlockRange range, SolverBodies& bodies, bool with_friction, TargetOf target_of) {
    Real change = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        Real delta = 0;
        for (int i = block.first; i < block.first + block.count; ++i)
            delta = std::max(delta, u.solve_normal(block, pool.normals[i], pool.impulse[i].normal, target_of(pool.normals[i])));
        if (with_friction && block.friction >= 0) delta = std::max(delta, sweep_block_friction(pool, block, u));
        u.store(block, bodies);
        change = std::max(change, delta * block.max_inv_mass);
    }
    return change;
}

// The same impulse at every point of a block, as much as moves the points by what they lack on average. Point after point instead, the
// first ones take what all need and tip a body that is pushed out of another.
template <typename TargetOf>
void push_evenly(ContactPool& pool, const ContactBlock& block, BlockVelocity& u, TargetOf target_of) {
    PointRow sum;
    Real lack = 0, least = kInfinity;
    for (int i = block.first; i < block.first + block.count; ++i) {
        const NormalRow& row = pool.normals[i];
        sum.ang_a += row.ang_a;
        sum.ang_b += row.ang_b;
        sum.iang_a += row.iang_a;
        sum.iang_b += row.iang_b;
        lack += target_of(row) - u.along(block.n, row);
        least = std::min(least, pool.impulse[i].normal);
    }
    const Real S = block.count * block.count * block.inv_mass_sum + sum.ang_a.dot(sum.iang_a) + sum.ang_b.dot(sum.iang_b);
    const Real lambda = std::max(lack / S, -least);
    for (int i = block.first; i < block.first + block.count; ++i) pool.impulse[i].normal += lambda;
    u.apply(block, block.count * block.n, sum, lambda);
}

// The first solve has no friction rows; it has half of the substep's friction from the warm start. A manifold that it ended without any
// normal impulse has no friction either, and what the warm start gave goes back before the drift: after an impact that is followed by
// nothing bodies would be carried on by it for a substep. Single points without impulse keep theirs: what few sweeps give to one corner of
// a face they take from another.
void return_warm_friction(ContactPool& pool, const ContactBlock& block, SolverBodies& bodies) {
    for (int p = block.first; p < block.first + block.count; ++p)
        if (pool.impulse[p].normal > 0) return;
    BlockVelocity u(block, bodies);
    for (int i = 0; i < block.count; ++i) {
        PointImpulse& impulse = pool.impulse[block.first + i];
        for (int j = 0; j < 2; ++j) {
            const FrictionRow& row = pool.frictions[block.friction + 2 * i + j];
            if (impulse.friction[j] != 0) u.apply(block, row.t, row, -impulse.friction[j]);
            impulse.friction[j] = 0;
        }
    }
    u.store(block, bodies);
}

// Adds the impulses that `normal_of` and `friction_of` take from the warm ones.
template <typename NormalOf, typename FrictionOf>
void warm_start(ContactPool& pool, BlockRange range, SolverBodies& bodies, NormalOf normal_of, FrictionOf friction_of) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            const int p = block.first + i;
            const WarmImpulse& warm = pool.warm[p];
            PointImpulse& impulse = pool.impulse[p];
            const Real normal = normal_of(warm, impulse.normal);
            if (normal != 0) u.apply(block, block.n, pool.normals[p], normal);
            impulse.normal += normal;
            if (block.friction < 0 || (warm.friction[0] == 0 && warm.friction[1] == 0)) continue;
            for (int j = 0; j < 2; ++j) {
                const FrictionRow& row = pool.frictions[block.friction + 2 * i + j];
                const Real friction = friction_of(warm, j);
                impulse.friction[j] += friction;
                u.apply(block, row.t, row, friction);
            }
        }
        u.store(block, bodies);
    }
}

void set_tangents(ContactPool& pool, const ContactBlock& block, int i, const Vec3& t1) {
    FrictionRow* friction = &pool.frictions[block.friction + 2 * i];
    friction[0].t = t1;
    friction[1].t = block.n.cross(t1);
}

inline void set_point_row(PointRow& row, const Vec3& direction, const Vec3& r_a, const Vec3& r_b, const BodyMotion& a,
                          const BodyMotion& b) {
    Real s = a.inv_mass + b.inv_mass;
    row.ang_a = r_a.cross(direction);
    row.ang_b = r_b.cross(direction);
    row.iang_a.setZero();
    row.iang_b.setZero();
    if (a.inv_mass > 0) {
        row.iang_a = a.inv_inertia_W.lazyProduct(row.ang_a);
        s += row.ang_a.dot(row.iang_a);
    }
    if (b.inv_mass > 0) {
        row.iang_b = b.inv_inertia_W.lazyProduct(row.ang_b);
        s += row.ang_b.dot(row.iang_b);
    }
    row.mass = s > 0 ? 1 / s : 0;
}

}  // namespace

void ContactPool::clear() {
    spins.clear();
    block_count = point_count = friction_count = 0;
}

PointRange points_of(const ContactPool& pool, BlockRange range) {
    const ContactBlock &first = pool.blocks[range.begin], &last = pool.blocks[range.end - 1];
    return {first.first, last.first + last.count};
}

void ContactPool::make_room(std::size_t more_blocks, std::size_t points, std::size_t friction_rows) {
    if (block_count + more_blocks > blocks.size()) blocks.resize(block_count + more_blocks);
    const std::size_t p = point_count + points, f = friction_count + friction_rows;
    if (p > normals.size()) {
        normals.resize(p);
        geometry.resize(p);
        posed.resize(p);
        warm.resize(p);
        impulse.resize(p);
        total.resize(p);
    }
    if (f > frictions.size()) frictions.resize(f);
}

PointRow make_point_row(const Vec3& direction, const Vec3& r_a, const Vec3& r_b, const BodyMotion& a, const BodyMotion& b) {
    PointRow row;
    set_point_row(row, direction, r_a, r_b, a, b);
    return row;
}

void orient_normal(ContactBlock& block, const SolverBodies& bodies) {
    if (block.frame == NormalFrame::kA) block.n = bodies.motion[block.a].R * block.n_local;
    if (block.frame == NormalFrame::kB) block.n = bodies.motion[block.b].R * block.n_local;
}

// Projecting leaves an error of 1e-16 of t along n; of what is left of t it may be a thousand times as much, no more. A slip may be slow:
// its direction counts, not its length.
Vec3 tangent_along(const Vec3& direction, const Vec3& n) {
    const Vec3 t = direction - n * n.dot(direction);
    const Real length = t.norm();
    return length > kLeastTangent * direction.norm() ? Vec3(t / length) : any_perpendicular(n);
}

void build_rows(ContactPool& pool, ContactBlock& block, const SolverBodies& bodies) {
    const BodyMotion& a = bodies.motion[block.a];
    const BodyMotion& b = bodies.motion[block.b];
    block.built_turn_a = a.turned;
    block.built_turn_b = b.turned;
    Real least_mass = kInfinity;
    const Vec3 n = block.n;
    const Vec3 wa = bodies.velocity[block.a].w, wb = bodies.velocity[block.b].w;
    for (int i = 0; i < block.count; ++i) {
        const PointGeometry& g = pool.geometry[block.first + i];
        const Vec3 core_a = a.R * g.core_a_A, core_b = b.R * g.core_b_B;
        const Real separation = n.dot(a.x + core_a - b.x - core_b) - g.radius_a - g.radius_b;
        // r_A is the surface point of the side whose core is exact; r_B is the foot of its perpendicular on the other's surface.
        Vec3 r_a, r_b;
        if (block.frame == NormalFrame::kA) {
            r_b = core_b + g.radius_b * n;
            r_a = b.x + r_b + separation * n - a.x;
        } else {
            r_a = core_a - g.radius_a * n;
            // After an impact inside the substep n is that of the impact, and so are the arms of cores.
            const bool has_met = block.frame == NormalFrame::kCores && pool.normals[block.first].lift > 0;
            r_b = has_met ? Vec3(core_b + g.radius_b * n) : Vec3(a.x + r_a - separation * n - b.x);
        }
        NormalRow& row = pool.normals[block.first + i];
        set_point_row(row, n, r_a, r_b, a, b);
        row.separation = separation;
        row.touching = true;
        least_mass = std::min(least_mass, row.mass);
        // Centripetal acceleration of the material core points; the face that owns n is taken as flat.
        row.curvature = 0;
        if (block.frame != NormalFrame::kA) row.curvature += n.dot(wa.cross(wa.cross(core_a)));
        if (block.frame != NormalFrame::kB) row.curvature -= n.dot(wb.cross(wb.cross(core_b)));
        for (int j = 0; j < 2 && block.friction >= 0; ++j) {
            FrictionRow& friction = pool.frictions[block.friction + 2 * i + j];
            set_point_row(friction, friction.t, r_a, r_b, a, b);
            least_mass = std::min(least_mass, friction.mass);
        }
    }
    block.max_inv_mass = 1 / least_mass;
}

void build_contacts(ContactPool& pool, BlockRange range, const SolverBodies& bodies) {
    for (int k = range.begin; k < range.end; ++k) {
        ContactBlock& block = pool.blocks[k];
        for (int p = block.first; p < block.first + block.count; ++p) {
            pool.normals[p] = {};
            pool.impulse[p] = pool.total[p] = {};
        }
        for (int i = 0; i < block.count && block.friction >= 0; ++i) set_tangents(pool, block, i, pool.geometry[block.first + i].t1);
        build_rows(pool, block, bodies);
    }
}

void build_block(ContactPool& pool, ContactBlock& block, const SolverBodies& bodies) {
    orient_normal(block, bodies);
    for (int i = 0; i < block.count && block.friction >= 0; ++i)
        set_tangents(pool, block, i, tangent_along(pool.frictions[block.friction + 2 * i].t, block.n));
    build_rows(pool, block, bodies);
}

void advance_blocks(ContactPool& pool, BlockRange range, const SolverBodies& bodies, Real h, Real tolerance) {
    for (int k = range.begin; k < range.end; ++k) {
        ContactBlock& block = pool.blocks[k];
        const Real turn = bodies.motion[block.a].turned - block.built_turn_a + bodies.motion[block.b].turned - block.built_turn_b;
        if (turn > tolerance) {
            build_block(pool, block, bodies);
        } else {
            const BlockVelocity u(block, bodies);
            for (int i = block.first; i < block.first + block.count; ++i)
                pool.normals[i].separation += h * u.along(block.n, pool.normals[i]);
        }
    }
}

Real largest_warm(const ContactPool& pool, BlockRange range) {
    Real largest = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        for (int p = block.first; p < block.first + block.count; ++p)
            largest = std::max({largest, pool.warm[p].position, pool.warm[p].position + pool.warm[p].velocity});
    }
    return largest;
}

void scale_warm_start(ContactPool& pool, BlockRange range, Real scale) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        for (int p = block.first; p < block.first + block.count; ++p) {
            WarmImpulse& warm = pool.warm[p];
            warm.position *= scale;
            warm.velocity *= scale;
            for (int j = 0; j < 2; ++j) {
                warm.friction[j] *= scale;
                warm.friction_first[j] *= scale;
            }
        }
    }
}

void warm_start_first(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    warm_start(
        pool, range, bodies, [](const WarmImpulse& warm, Real) { return warm.position; },
        [](const WarmImpulse& warm, int j) { return warm.friction_first[j]; });
}

void warm_start_second(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    warm_start(
        pool, range, bodies, [](const WarmImpulse& warm, Real accumulated) { return std::max(warm.velocity, -accumulated); },
        [](const WarmImpulse& warm, int j) { return warm.friction[j] - warm.friction_first[j]; });
}

void warm_start_all(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    warm_start(
        pool, range, bodies, [](const WarmImpulse& warm, Real) { return warm.position + warm.velocity; },
        [](const WarmImpulse& warm, int j) { return warm.friction[j]; });
}

void hold_contacts(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        if (block.friction >= 0) return_warm_friction(pool, block, bodies);
        for (int i = 0; i < block.count; ++i) {
            const PointImpulse& impulse = pool.impulse[block.first + i];
            pool.normals[block.first + i].held_impulse = impulse.normal;
            if (block.friction < 0) continue;
            for (int j = 0; j < 2; ++j) pool.frictions[block.friction + 2 * i + j].held_impulse = impulse.friction[j];
        }
    }
}

void release_contacts(ContactPool& pool, BlockRange range) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        for (int i = 0; i < block.count; ++i) {
            PointImpulse& impulse = pool.impulse[block.first + i];
            NormalRow& row = pool.normals[block.first + i];
            row.touching = impulse.normal > 0 || row.separation <= 0;
            impulse.normal = row.held_impulse;
            if (block.friction < 0) continue;
            for (int j = 0; j < 2; ++j) impulse.friction[j] = pool.frictions[block.friction + 2 * i + j].held_impulse;
        }
    }
}

void keep_impulse_share(ContactPool& pool, BlockRange range, Real share) {
    const auto keep = [share](Real& impulse, Real held) { impulse = held + share * (impulse - held); };
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        for (int i = 0; i < block.count; ++i) {
            PointImpulse& impulse = pool.impulse[block.first + i];
            keep(impulse.normal, pool.normals[block.first + i].held_impulse);
            for (int j = 0; j < 2 && block.friction >= 0; ++j)
                keep(impulse.friction[j], pool.frictions[block.friction + 2 * i + j].held_impulse);
        }
    }
}

void close_contact_substep(ContactPool& pool, BlockRange range, FirstFriction first) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        for (int i = 0; i < block.count; ++i) {
            const int p = block.first + i;
            PointImpulse &impulse = pool.impulse[p], &total = pool.total[p];
            WarmImpulse& warm = pool.warm[p];
            warm.position = pool.normals[p].held_impulse;
            warm.velocity = impulse.normal - warm.position;
            total.normal += impulse.normal;
            for (int j = 0; block.friction >= 0 && j < 2; ++j) {
                warm.friction[j] = impulse.friction[j];
                warm.friction_first[j] =
                    first == FirstFriction::kHalf ? 0.5 * impulse.friction[j] : pool.frictions[block.friction + 2 * i + j].held_impulse;
                total.friction[j] += impulse.friction[j];
            }
            impulse = {};
        }
    }
}

Real sweep_contact_gaps(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h) {
    return sweep(pool, range, bodies, false, [h](const NormalRow& row) { return gap_target(row, h, 0); });
}

void push_contacts(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h, Real rate) {
    const auto target_of = [h, rate](const NormalRow& row) { return gap_target(row, h, rate); };
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        if (block.count > 1) push_evenly(pool, block, u, target_of);
        for (int i = block.first; i < block.first + block.count; ++i)
            u.solve_normal(block, pool.normals[i], pool.impulse[i].normal, target_of(pool.normals[i]));
        u.store(block, bodies);
    }
}

Real sweep_contact_velocities(ContactPool& pool, BlockRange range, SolverBodies& bodies, bool with_friction) {
    // What has not arrived yet is not held: its impulse returns to zero.
    return sweep(pool, range, bodies, with_friction, [](const NormalRow& row) { return velocity_target(row); });
}

}  // namespace cairn
