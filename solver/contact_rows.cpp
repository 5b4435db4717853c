#include "solver/contact_rows.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

// Velocities of a block's two bodies, held in registers while its rows are visited.
struct BlockVelocity {
    Vec3 va, wa, vb, wb;

    BlockVelocity(const ContactBlock& block, const SolverBodies& bodies)
        : va(bodies.velocity[block.a].v), wa(bodies.velocity[block.a].w), vb(bodies.velocity[block.b].v), wb(bodies.velocity[block.b].w) {}

    // G v of a row.
    Real along(const Vec3& direction, const PointRow& row) const { return direction.dot(va - vb) + row.ang_a.dot(wa) - row.ang_b.dot(wb); }

    // v += M⁻¹ Gᵀ λ.
    void apply(const ContactBlock& block, const Vec3& direction, const PointRow& row, Real lambda) {
        va += (block.inv_mass_a * lambda) * direction;
        wa += lambda * row.iang_a;
        vb -= (block.inv_mass_b * lambda) * direction;
        wb -= lambda * row.iang_b;
    }

    // Bodies that cannot move are shared between islands and stay untouched.
    void store(const ContactBlock& block, SolverBodies& bodies) const {
        if (block.inv_mass_a > 0) bodies.velocity[block.a] = {va, wa};
        if (block.inv_mass_b > 0) bodies.velocity[block.b] = {vb, wb};
    }
};

// Both friction rows of each point of a block, bounds from the accumulated normal impulses. Returns the largest velocity change.
template <bool kMeasure>
Real sweep_block_friction(ContactPool& pool, const ContactBlock& block, BlockVelocity& u) {
    Real change = 0;
    for (int i = 0; i < block.count; ++i) {
        PointImpulse& impulse = pool.impulse[block.first + i];
        const Real limit = block.mu * impulse.normal;
        for (int k = 0; k < 2; ++k) {
            const FrictionRow& row = pool.frictions[block.friction + 2 * i + k];
            const Real old = impulse.friction[k];
            impulse.friction[k] = std::clamp(old - row.mass * u.along(row.t, row), -limit, limit);
            const Real delta = impulse.friction[k] - old;
            u.apply(block, row.t, row, delta);
            if constexpr (kMeasure) change = std::max(change, std::abs(delta) / row.mass);
        }
    }
    return change;
}

// Adds the impulses that `normal_of` and `friction_share` take from the warm ones.
template <typename NormalOf>
void warm_start(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real friction_share, NormalOf normal_of) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        for (int i = 0; i < block.count; ++i) {
            const int p = block.first + i;
            const WarmImpulse& warm = pool.warm[p];
            PointImpulse& impulse = pool.impulse[p];
            const Real normal = normal_of(warm, impulse.normal);
            impulse.normal += normal;
            u.apply(block, block.n, pool.normals[p], normal);
            if (block.friction < 0) continue;
            for (int j = 0; j < 2; ++j) {
                const FrictionRow& row = pool.frictions[block.friction + 2 * i + j];
                const Real friction = friction_share * warm.friction[j];
                impulse.friction[j] += friction;
                u.apply(block, row.t, row, friction);
            }
        }
        u.store(block, bodies);
    }
}

template <bool kMeasure>
Real positions(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h) {
    const Real inv_h = 1 / h;
    Real change = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        for (int i = block.first; i < block.first + block.count; ++i) {
            const NormalRow& row = pool.normals[i];
            Real& lambda = pool.impulse[i].normal;
            const Real gap = row.separation + 0.5 * h * h * row.curvature - row.lift;
            const Real velocity = u.along(block.n, row);
            Real delta;
            if (gap > 0 || row.lift > 0) {
                delta = -row.mass * (velocity + gap * inv_h);
            } else {
                delta = -block.soft.mass_scale * row.mass * (velocity + block.soft.rate * gap * inv_h) - block.soft.impulse_scale * lambda;
            }
            const Real next = std::max(lambda + delta, 0.0);
            delta = next - lambda;
            lambda = next;
            u.apply(block, block.n, row, delta);
            if constexpr (kMeasure) change = std::max(change, std::abs(delta) / row.mass);
        }
        u.store(block, bodies);
    }
    return change;
}

template <bool kMeasure>
Real velocities(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    Real change = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        for (int i = block.first; i < block.first + block.count; ++i) {
            const NormalRow& row = pool.normals[i];
            Real& lambda = pool.impulse[i].normal;
            // What has not arrived yet is not held: the total impulse returns to zero.
            const Real target = !row.touching ? -kInfinity : row.lift > 0 ? row.bounce : 0.0;
            const Real next = std::max(lambda - row.mass * (u.along(block.n, row) - target), 0.0);
            const Real delta = next - lambda;
            lambda = next;
            u.apply(block, block.n, row, delta);
            if constexpr (kMeasure) change = std::max(change, std::abs(delta) / row.mass);
        }
        if (block.friction >= 0) change = std::max(change, sweep_block_friction<kMeasure>(pool, block, u));
        u.store(block, bodies);
    }
    return change;
}

template <bool kMeasure>
Real target_velocity(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h, Real beta) {
    const Real inv_h = 1 / h;
    Real change = 0;
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        BlockVelocity u(block, bodies);
        for (int i = block.first; i < block.first + block.count; ++i) {
            const NormalRow& row = pool.normals[i];
            Real& lambda = pool.impulse[i].normal;
            const Real bias = row.separation > 0 ? -row.separation * inv_h : -beta * row.separation * inv_h;
            const Real target = row.lift > 0 ? row.bounce : bias;
            const Real next = std::max(lambda - row.mass * (u.along(block.n, row) - target), 0.0);
            const Real delta = next - lambda;
            lambda = next;
            u.apply(block, block.n, row, delta);
            if constexpr (kMeasure) change = std::max(change, std::abs(delta) / row.mass);
        }
        if (block.friction >= 0) change = std::max(change, sweep_block_friction<kMeasure>(pool, block, u));
        u.store(block, bodies);
    }
    return change;
}

}  // namespace

void ContactPool::clear() {
    blocks.clear();
    normals.clear();
    geometry.clear();
    frictions.clear();
    warm.clear();
    impulse.clear();
    total.clear();
}

PointRow make_point_row(const Vec3& direction, const Vec3& r_a, const Vec3& r_b, const BodyMotion& a, const BodyMotion& b) {
    PointRow row;
    row.ang_a = r_a.cross(direction);
    row.ang_b = r_b.cross(direction);
    row.iang_a = a.inv_inertia_W * row.ang_a;
    row.iang_b = b.inv_inertia_W * row.ang_b;
    const Real s = a.inv_mass + b.inv_mass + row.ang_a.dot(row.iang_a) + row.ang_b.dot(row.iang_b);
    row.mass = s > 0 ? 1 / s : 0;
    return row;
}

void build_block(ContactPool& pool, ContactBlock& block, const SolverBodies& bodies) {
    const BodyMotion& a = bodies.motion[block.a];
    const BodyMotion& b = bodies.motion[block.b];
    block.built_turn_a = a.turned;
    block.built_turn_b = b.turned;
    if (block.frame == NormalFrame::kA) block.n = a.R * block.n_local;
    if (block.frame == NormalFrame::kB) block.n = b.R * block.n_local;
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
            r_b = a.x + r_a - separation * n - b.x;
        }
        NormalRow& row = pool.normals[block.first + i];
        static_cast<PointRow&>(row) = make_point_row(n, r_a, r_b, a, b);
        row.separation = separation;
        // Centripetal acceleration of the material core points; the face that owns n is taken as flat.
        row.curvature = 0;
        if (block.frame != NormalFrame::kA) row.curvature += n.dot(wa.cross(wa.cross(core_a)));
        if (block.frame != NormalFrame::kB) row.curvature -= n.dot(wb.cross(wb.cross(core_b)));
        if (block.friction < 0) continue;
        FrictionRow* friction = &pool.frictions[block.friction + 2 * i];
        Vec3 t1 = friction[0].t - n * n.dot(friction[0].t);
        const Real length = t1.norm();
        t1 = length > 1e-6 ? Vec3(t1 / length) : any_perpendicular(n);
        const Vec3 t2 = n.cross(t1);
        static_cast<PointRow&>(friction[0]) = make_point_row(t1, r_a, r_b, a, b);
        static_cast<PointRow&>(friction[1]) = make_point_row(t2, r_a, r_b, a, b);
        friction[0].t = t1;
        friction[1].t = t2;
    }
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
        for (int i = block.first; i < block.first + block.count; ++i) {
            pool.normals[i].position_impulse = pool.impulse[i].normal;
            pool.normals[i].touching = pool.impulse[i].normal > 0 || pool.normals[i].separation <= 0;
        }
    }
}

void scale_warm_start(ContactPool& pool, BlockRange range, Real scale) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        for (int p = block.first; p < block.first + block.count; ++p) {
            WarmImpulse& warm = pool.warm[p];
            warm.position *= scale;
            warm.velocity *= scale;
            for (Real& f : warm.friction) f *= scale;
        }
    }
}

void warm_start_positions(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    warm_start(pool, range, bodies, 0.5, [](const WarmImpulse& warm, Real) { return warm.position; });
}

void warm_start_velocities(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    warm_start(pool, range, bodies, 0.5, [](const WarmImpulse& warm, Real accumulated) { return std::max(warm.velocity, -accumulated); });
}

void warm_start_all(ContactPool& pool, BlockRange range, SolverBodies& bodies) {
    warm_start(pool, range, bodies, 1, [](const WarmImpulse& warm, Real) { return warm.position + warm.velocity; });
}

void close_contact_substep(ContactPool& pool, BlockRange range) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        for (int p = block.first; p < block.first + block.count; ++p) {
            PointImpulse &impulse = pool.impulse[p], &total = pool.total[p];
            WarmImpulse& warm = pool.warm[p];
            warm.position = pool.normals[p].position_impulse;
            warm.velocity = impulse.normal - warm.position;
            total.normal += impulse.normal;
            for (int j = 0; j < 2; ++j) {
                warm.friction[j] = impulse.friction[j];
                total.friction[j] += impulse.friction[j];
            }
            impulse = {};
        }
    }
}

Real sweep_contact_positions(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h, bool measure) {
    return measure ? positions<true>(pool, range, bodies, h) : positions<false>(pool, range, bodies, h);
}

Real sweep_contact_velocities(ContactPool& pool, BlockRange range, SolverBodies& bodies, bool measure) {
    return measure ? velocities<true>(pool, range, bodies) : velocities<false>(pool, range, bodies);
}

Real sweep_contact_target_velocity(ContactPool& pool, BlockRange range, SolverBodies& bodies, Real h, Real beta, bool measure) {
    return measure ? target_velocity<true>(pool, range, bodies, h, beta) : target_velocity<false>(pool, range, bodies, h, beta);
}

void predict_bounces(ContactPool& pool, BlockRange range, const SolverBodies& bodies, Real h) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = pool.blocks[k];
        if (block.restitution == 0) continue;
        const BlockVelocity u(block, bodies);
        const Real a = block.n.dot(bodies.motion[block.a].acceleration * (block.inv_mass_a > 0) -
                                   bodies.motion[block.b].acceleration * (block.inv_mass_b > 0));
        for (int i = block.first; i < block.first + block.count; ++i) {
            NormalRow& row = pool.normals[i];
            row.lift = row.bounce = 0;
            const Real s = std::max(row.separation, 0.0), v = u.along(block.n, row);
            // First root τ of s + v τ + a τ²/2 = 0, in the form that does not cancel.
            const Real d = v * v - 2 * a * s;
            if (d < 0) continue;
            const Real root = std::sqrt(d);
            if (root - v <= 0) continue;
            const Real tau = 2 * s / (root - v);
            if (!(tau < h) || root == 0) continue;
            // It arrives with −root, leaves with e root, and flies on for h − τ.
            const Real rest = h - tau;
            const Real lift = (block.restitution * root + 0.5 * a * rest) * rest;
            if (lift <= 0) continue;  // back on the ground within the substep: it rests
            row.lift = lift;
            row.bounce = block.restitution * root + a * rest;
        }
    }
}

}  // namespace cairn
