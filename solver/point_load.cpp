#include "solver/point_load.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// What the tangents of a block's points have in common: the change of relative velocity over the step by external forces, tangential [m/s],
// and the scale against which a slip is slow.
struct Pull {
    Vec3 tangential;
    Real scale;
};

Pull external_pull(const SolverBodies& bodies, const ContactBlock& block, Real dt) {
    const auto acceleration = [&](int i) -> Vec3 {
        return bodies.motion[i].inv_mass > 0 ? bodies.motion[i].acceleration : Vec3(Vec3::Zero());
    };
    const Vec3 a = acceleration(block.a), b = acceleration(block.b), pull = dt * (a - b);
    return {pull - block.n * block.n.dot(pull), dt * std::sqrt(std::max(a.squaredNorm(), b.squaredNorm()))};
}

Vec3 slip_velocity(const SolverBodies& bodies, const ContactBlock& block, const PointState& state) {
    const BodyMotion &a = bodies.motion[block.a], &b = bodies.motion[block.b];
    const BodyVelocity &ua = bodies.velocity[block.a], &ub = bodies.velocity[block.b];
    const Vec3 r_a = a.R * state.core_a_A - state.radius_a * block.n, r_b = (a.x - b.x) + r_a;
    const Vec3 v = (ua.v + ua.w.cross(r_a)) - (ub.v + ub.w.cross(r_b));
    return v - block.n * block.n.dot(v);
}

// Of any length.
Vec3 first_tangent(FrictionModel model, const ContactBlock& block, const Vec3& slip, const Pull& pull, const Vec3& previous) {
    const bool slips = slip.squaredNorm() > 0;
    if (model == FrictionModel::kPyramidFixed || (model == FrictionModel::kOneDirection && !slips)) return any_perpendicular(block.n);
    if (slips && (model == FrictionModel::kOneDirection || slip.squaredNorm() > pull.scale * pull.scale)) return slip;
    const Vec3 predicted = slip + pull.tangential;
    return predicted.norm() > 1e-3 * pull.scale ? predicted : previous;
}

void load_point(ContactPool& pool, const ContactBlock& block, int i, const SolverBodies& bodies, const PointLoad& load, const Pull& pull) {
    const PointState& state = posed_states(pool, block)[i];
    PointGeometry& g = pool.geometry[block.first + i];
    g.core_a_A = state.core_a_A;
    g.core_b_B = state.core_b_B;
    g.radius_a = state.radius_a;
    g.radius_b = state.radius_b;
    WarmImpulse& warm = pool.warm[block.first + i] = {};
    warm.position = load.warm_scale * state.warm_position;
    warm.velocity = load.warm_scale * state.warm_velocity;
    if (block.friction < 0) return;
    g.t1 = tangent_along(first_tangent(load.friction, block, slip_velocity(bodies, block, state), pull, state.t1), block.n);
    block.states[i].t1 = g.t1;
    const Vec3 t2 = block.n.cross(g.t1);
    warm.friction[0] = load.warm_scale * g.t1.dot(state.warm_friction);
    warm.friction_first[0] = load.warm_scale * g.t1.dot(state.warm_friction_first);
    if (load.friction == FrictionModel::kOneDirection) return;
    warm.friction[1] = load.warm_scale * t2.dot(state.warm_friction);
    warm.friction_first[1] = load.warm_scale * t2.dot(state.warm_friction_first);
}

Vec3 unsigned_zeros(const Vec3& v) {
    return v.array() + 0.0;
}

void store_point(PointState& state, const WarmImpulse& warm, const PointImpulse& total, const Vec3& t1, const Vec3& t2) {
    state.warm_position = warm.position + 0.0;
    state.warm_velocity = warm.velocity + 0.0;
    state.warm_friction = unsigned_zeros(warm.friction[0] * t1 + warm.friction[1] * t2);
    state.warm_friction_first = unsigned_zeros(warm.friction_first[0] * t1 + warm.friction_first[1] * t2);
    state.normal_impulse = total.normal + 0.0;
    state.friction_impulse[0] = total.friction[0] + 0.0;
    state.friction_impulse[1] = total.friction[1] + 0.0;
}

void prefetch_states([[maybe_unused]] const ContactBlock& block) {
#if defined(__GNUC__)
    constexpr std::size_t kLine = 64;
    for (std::size_t at = 0; at < block.count * sizeof(PointState); at += kLine)
        __builtin_prefetch(reinterpret_cast<const char*>(block.states) + at, 1);
#endif
}
constexpr int kAhead = 4;  // blocks

}  // namespace

void load_points(ContactPool& pool, BlockRange range, const SolverBodies& bodies, const PointLoad& load) {
    for (int k = range.begin; k < range.end; ++k) {
        if (k + kAhead < range.end) prefetch_states(pool.blocks[k + kAhead]);
        const ContactBlock& block = pool.blocks[k];
        const Pull pull = block.friction < 0 ? Pull{} : external_pull(bodies, block, load.dt);
        for (int i = 0; i < block.count; ++i) load_point(pool, block, i, bodies, load, pull);
    }
}

void store_points(const ContactPool& pool, BlockRange range) {
    const Vec3 none = Vec3::Zero();
    for (int k = range.begin; k < range.end; ++k) {
        if (k + kAhead < range.end) prefetch_states(pool.blocks[k + kAhead]);
        const ContactBlock& block = pool.blocks[k];
        for (int i = 0; i < block.count; ++i) {
            const FrictionRow* rows = block.friction < 0 ? nullptr : &pool.frictions[block.friction + 2 * i];
            store_point(block.states[i], pool.warm[block.first + i], pool.total[block.first + i], rows ? rows[0].t : none,
                        rows ? rows[1].t : none);
        }
    }
}

}  // namespace cairn
