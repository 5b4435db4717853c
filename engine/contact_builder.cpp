// Stage 4a: manifolds → contact rows of an island.
#include "engine/world_data.hpp"

#include <algorithm>

namespace cairn {
namespace {

// How a body of a contact enters the solver: its index, and the frame that the solver's copy of it has. What cannot move is the one
// immovable body, whose frame is the world's.
struct SolverBody {
    int index = kImmovable;
    bool same_frame = true;
    Transform X_SB;  // body frame in the solver body's frame, where that is another one

    Vec3 point(const Vec3& p_B) const { return same_frame ? p_B : X_SB * p_B; }
    Vec3 direction(const Vec3& d_B) const { return same_frame ? d_B : Vec3(X_SB.R * d_B); }
};

// One that is in the solver, or cannot move.
void find_solver_body(const WorldData& world, const IslandWorkspace& work, std::uint32_t body, SolverBody& out) {
    out.same_frame = true;
    out.index = work.solver_index[body];
    if (out.index < 0) out = {kImmovable, false, world.bodies[body].transform()};
}

// The same, and kinematic bodies, which it adds to the island.
void set_solver_body(WorldData& world, IslandWorkspace& work, std::uint32_t body, SiIsland& island, SolverBody& out) {
    const Body& b = world.bodies[body];
    if (work.solver_index[body] < 0 && b.type == BodyType::kKinematic && b.enabled) add_kinematic(world, work, body, island);
    find_solver_body(world, work, body, out);
}

// t₁: along the slip; where that is slower than what the external acceleration makes in the step, along the slip that it will make; where
// that is slow too, as it was. `slip` and `pull` are tangential: relative velocity [m/s], and its change over the step by external forces.
Vec3 tangent_direction(const Vec3& slip, const Vec3& pull, Real pull_scale, const Vec3& previous) {
    if (slip.squaredNorm() > pull_scale * pull_scale && slip.squaredNorm() > 0) return slip;
    const Vec3 predicted = slip + pull;
    if (predicted.norm() > 1e-3 * pull_scale) return predicted;
    return previous;
}

// t₁ as the friction model has it.
Vec3 model_tangent(FrictionModel model, const Vec3& n, const Vec3& slip, const Vec3& pull, Real pull_scale, const Vec3& previous) {
    const Real speed = slip.norm();
    if (model == FrictionModel::kOneDirection && speed > 0) return slip / speed;
    if (model == FrictionModel::kOneDirection || model == FrictionModel::kPyramidFixed) return any_perpendicular(n);
    return tangent_direction(slip, pull, pull_scale, previous);
}

// What the tangents of a manifold's points have in common: the change of relative velocity over the step by external forces, tangential,
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

Vec3 slip_velocity(const SolverBodies& bodies, const Vec3& n, const ContactBlock& block, const Vec3& point) {
    const auto velocity = [&](int i) -> Vec3 { return bodies.velocity[i].v + bodies.velocity[i].w.cross(point - bodies.motion[i].x); };
    const Vec3 v = block.b == kImmovable   ? velocity(block.a)
                   : block.a == kImmovable ? Vec3(-velocity(block.b))
                                           : Vec3(velocity(block.a) - velocity(block.b));
    return v - n * n.dot(v);
}

NormalFrame normal_frame(NormalOwner owner) {
    switch (owner) {
        case NormalOwner::kA:
            return NormalFrame::kA;
        case NormalOwner::kB:
            return NormalFrame::kB;
        case NormalOwner::kCores:
            return NormalFrame::kCores;
        case NormalOwner::kNone:
            break;
    }
    return NormalFrame::kWorld;
}

bool has_friction(const WorldData& world, const Contact& c) {
    return c.mu > 0 && world.settings.model.friction != FrictionModel::kNone;
}

// The last block's torsional and rolling friction: the larger coefficient of the two bodies.
void add_spin(WorldData& world, ContactPool& pool, const Contact& c, const CachedManifold& m) {
    const BodyInfo &a = world.info[c.body_a], &b = world.info[c.body_b];
    SpinRow row;
    row.torsional = std::max(a.torsional_friction, b.torsional_friction);
    row.rolling = std::max(a.rolling_friction, b.rolling_friction);
    if (row.torsional == 0 && row.rolling == 0) return;
    row.block = static_cast<int>(pool.block_count) - 1;
    row.warm = m.warm_spin;
    pool.spins.push_back(row);
}

// Builds the block at `place`, for which there must be room, and moves on to the next place.
void build_manifold(const WorldData& world, IslandWorkspace& work, Real dt, const Contact& c, CachedManifold& m, const SolverBody& a,
                    const SolverBody& b, ContactPlace& place) {
    ContactPool& pool = work.contact_pool;
    ContactBlock block;
    block.a = a.index;
    block.b = b.index;
    block.first = static_cast<int>(place.point);
    place.point += m.count;
    block.count = m.count;
    block.n = m.n;
    block.frame = normal_frame(m.owner);
    block.n_local = block.frame == NormalFrame::kA ? a.direction(m.n_local) : block.frame == NormalFrame::kB ? b.direction(m.n_local) : m.n;
    block.inv_mass_a = work.solver_bodies.motion[a.index].inv_mass;
    block.inv_mass_b = work.solver_bodies.motion[b.index].inv_mass;
    block.mu = c.mu;
    block.restitution = c.restitution;
    place.has_bounce |= c.restitution > 0;
    block.inv_mass_sum = block.inv_mass_a + block.inv_mass_b;
    block.share_a = block.inv_mass_a / block.inv_mass_sum;
    block.share_b = block.inv_mass_b / block.inv_mass_sum;
    const FrictionModel friction = world.settings.model.friction;
    if (has_friction(world, c)) {
        block.friction = static_cast<int>(place.friction);
        place.friction += 2 * m.count;
    }
    const Pull pull = external_pull(work.solver_bodies, block, dt);
    const Transform X_WA(work.solver_bodies.motion[a.index].R, work.solver_bodies.motion[a.index].x);
    orient_normal(block, work.solver_bodies);
    for (int i = 0; i < m.count; ++i) {
        CachedPoint& p = m.points[i];
        PointGeometry& g = pool.geometry[block.first + i];
        g.core_a_A = a.point(p.core_a_A);
        g.core_b_B = b.point(p.core_b_B);
        g.radius_a = p.radius_a;
        g.radius_b = p.radius_b;
        WarmImpulse& warm = pool.warm[block.first + i];
        warm = {p.warm_position, p.warm_velocity};
        if (block.friction < 0) continue;
        const Vec3 slip = slip_velocity(work.solver_bodies, m.n, block, X_WA * g.core_a_A - g.radius_a * m.n);
        g.t1 = p.t1 = tangent_along(model_tangent(friction, m.n, slip, pull.tangential, pull.scale, p.t1), block.n);
        warm.friction[0] = g.t1.dot(p.warm_friction);
        warm.friction_first[0] = g.t1.dot(p.warm_friction_first);
        if (friction == FrictionModel::kOneDirection) continue;
        const Vec3 t2 = block.n.cross(g.t1);
        warm.friction[1] = t2.dot(p.warm_friction);
        warm.friction_first[1] = t2.dot(p.warm_friction_first);
    }
    pool.blocks[place.block++] = block;
}

// One after the other; kinematic bodies are added to the island as they are met.
void build_in_turn(WorldData& world, IslandWorkspace& work, Real dt, const std::uint32_t* slots, int count, SiIsland& island) {
    ContactPool& pool = work.contact_pool;
    std::vector<Contact>& contacts = world.contacts.slots();
    SolverBody a, b;
    ContactPlace place{pool.block_count, pool.point_count, pool.friction_count};
    for (int k = 0; k < count; ++k) {
        Contact& c = contacts[slots[k]];
        prefetch_ahead(contacts, slots, static_cast<std::size_t>(k), static_cast<std::size_t>(count));
        set_solver_body(world, work, c.body_a, island, a);
        set_solver_body(world, work, c.body_b, island, b);
        for (int i = 0; i < c.manifold_count; ++i) {
            CachedManifold& m = c.manifold(i);
            if (m.count == 0) continue;
            pool.make_room(1, m.count, 2 * m.count);
            build_manifold(world, work, dt, c, m, a, b, place);
            pool.block_count = place.block;
            pool.point_count = place.point;
            pool.friction_count = place.friction;
            if (world.has_spin_friction && world.settings.model.friction != FrictionModel::kNone) add_spin(world, pool, c, m);
            work.block_sources.push_back({slots[k], &m});
        }
    }
    island.has_bounce |= place.has_bounce;
}

// The same by a team, in pieces whose places are counted beforehand. No kinematic bodies, no torsional or rolling friction.
void build_side_by_side(WorldData& world, IslandWorkspace& work, Real dt, const std::uint32_t* slots, int count, SiIsland& island) {
    constexpr std::size_t kPiece = 64;
    ContactPool& pool = work.contact_pool;
    std::vector<Contact>& contacts = world.contacts.slots();
    ContactPlace place{pool.block_count, pool.point_count, pool.friction_count};
    work.places.clear();
    for (int k = 0; k < count; ++k) {
        if (k % kPiece == 0) work.places.push_back(place);
        const Contact& c = contacts[slots[k]];
        place.point += c.point_count;
        if (has_friction(world, c)) place.friction += 2 * c.point_count;
        if (c.manifold_count == 1) place.block += c.point_count > 0;
        for (int i = 0; i < c.manifold_count && c.manifold_count > 1; ++i) place.block += c.manifold(i).count > 0;
    }
    pool.make_room(place.block - pool.block_count, place.point - pool.point_count, place.friction - pool.friction_count);
    work.block_sources.resize(place.block);
    pool.block_count = place.block;
    pool.point_count = place.point;
    pool.friction_count = place.friction;
    work.team->for_pieces(static_cast<std::size_t>(count), kPiece, [&](std::size_t begin, std::size_t end, int) {
        ContactPlace& at = work.places[begin / kPiece];
        SolverBody a, b;
        for (std::size_t k = begin; k < end; ++k) {
            Contact& c = contacts[slots[k]];
            prefetch_ahead(contacts, slots, k, end);
            find_solver_body(world, work, c.body_a, a);
            find_solver_body(world, work, c.body_b, b);
            for (int i = 0; i < c.manifold_count; ++i) {
                if (c.manifold(i).count == 0) continue;
                work.block_sources[at.block] = {slots[k], &c.manifold(i)};
                build_manifold(world, work, dt, c, c.manifold(i), a, b, at);
            }
        }
    });
    for (const ContactPlace& at : work.places) island.has_bounce |= at.has_bounce;
}

void store_point(CachedPoint& p, const WarmImpulse& warm, const PointImpulse& total) {
    p.warm_position = warm.position;
    p.warm_velocity = warm.velocity;
    p.normal_impulse = total.normal;
    p.friction_impulse[0] = total.friction[0];
    p.friction_impulse[1] = total.friction[1];
}

void store_friction(CachedPoint& p, const WarmImpulse& warm, const Vec3& t1, const Vec3& t2) {
    p.warm_friction_first = warm.friction_first[0] * t1 + warm.friction_first[1] * t2;
    p.warm_friction = warm.friction[0] * t1 + warm.friction[1] * t2;
}

CachedManifold& source_of(const IslandWorkspace& work, int block) {
    return *work.block_sources[block].manifold;
}

void prefetch_points(const CachedManifold& m, int count) {
    constexpr std::size_t kLine = 64;
    for (std::size_t at = 0; at < count * sizeof(CachedPoint); at += kLine)
        __builtin_prefetch(reinterpret_cast<const char*>(m.points.data()) + at, 1);
}

// Batches take their blocks from anywhere, so the manifolds of those to come are asked for.
void store_wide(IslandWorkspace& work, int begin, int end) {
    constexpr int kAhead = 2;  // batches
    const WideContacts& wide = work.wide_contacts;
    for (int k = begin; k < end; ++k) {
        for (int l = 0; k + kAhead < end && l < wide.lanes_of(k + kAhead); ++l)
            prefetch_points(source_of(work, wide.block_of(k + kAhead, l)), work.contact_pool.blocks[wide.block_of(k + kAhead, l)].count);
        for (int l = 0; l < wide.lanes_of(k); ++l) {
            const ContactBlock& block = work.contact_pool.blocks[wide.block_of(k, l)];
            CachedManifold& m = source_of(work, wide.block_of(k, l));
            for (int i = 0; i < block.count; ++i) {
                const WideContacts::Result r = wide.result(k, l, i);
                store_point(m.points[i], r.warm, r.total);
                if (block.friction >= 0) store_friction(m.points[i], r.warm, r.t[0], r.t[1]);
            }
        }
    }
}

}  // namespace

void build_contact_blocks(WorldData& world, IslandWorkspace& work, Real dt, const std::vector<std::uint32_t>& order, int begin, int end,
                          SiIsland& island) {
    if (work.team != nullptr && !world.has_spin_friction && world.active.kinematic.numbers().empty())
        build_side_by_side(world, work, dt, order.data() + begin, end - begin, island);
    else
        build_in_turn(world, work, dt, order.data() + begin, end - begin, island);
    island.contacts.end = static_cast<int>(work.contact_pool.block_count);
    island.spins.end = static_cast<int>(work.contact_pool.spins.size());
}

void store_contact_impulses(IslandWorkspace& work, const SiIsland& island) {
    if (work.is_island_wide) {
        constexpr std::size_t kPiece = 32;
        return for_pieces(
            work.team, static_cast<std::size_t>(work.wide_contacts.batch_count()), kPiece,
            [&](std::size_t first, std::size_t last, int) { store_wide(work, static_cast<int>(first), static_cast<int>(last)); });
    }
    const ContactPool& pool = work.contact_pool;
    for (int k = island.contacts.begin; k < island.contacts.end; ++k) {
        if (k + kPrefetchAhead < island.contacts.end)
            prefetch_points(source_of(work, k + kPrefetchAhead), pool.blocks[k + kPrefetchAhead].count);
        const ContactBlock& block = pool.blocks[k];
        CachedManifold& m = source_of(work, k);
        for (int i = 0; i < block.count; ++i) {
            const WarmImpulse& warm = pool.warm[block.first + i];
            store_point(m.points[i], warm, pool.total[block.first + i]);
            if (block.friction < 0) continue;
            const FrictionRow* rows = &pool.frictions[block.friction + 2 * i];
            store_friction(m.points[i], warm, rows[0].t, rows[1].t);
        }
    }
    for (int k = island.spins.begin; k < island.spins.end; ++k) source_of(work, pool.spins[k].block).warm_spin = pool.spins[k].warm;
}

}  // namespace cairn
