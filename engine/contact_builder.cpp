// Stage 4a: manifolds → contact rows of an island.
#include "engine/world_data.hpp"
#include "solver/point_load.hpp"

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

// The points of a manifold in the frames of the solver's bodies.
void pose_points(const CachedManifold& m, const SolverBody& a, const SolverBody& b, PointState* posed) {
    for (int i = 0; i < m.count; ++i) {
        posed[i] = m.points[i];
        posed[i].core_a_A = a.point(m.points[i].core_a_A);
        posed[i].core_b_B = b.point(m.points[i].core_b_B);
    }
}

// Builds the block at `place`, for which there must be room, and moves on to the next place. Its points are left where they are.
void build_manifold(const WorldData& world, IslandWorkspace& work, const Contact& c, CachedManifold& m, const SolverBody& a,
                    const SolverBody& b, ContactPlace& place) {
    ContactPool& pool = work.contact_pool;
    ContactBlock& block = pool.blocks[place.block++] = {};
    block.a = a.index;
    block.b = b.index;
    block.first = static_cast<int>(place.point);
    place.point += m.count;
    block.count = m.count;
    block.states = m.points.data();
    block.is_posed = !a.same_frame || !b.same_frame;
    if (block.is_posed) pose_points(m, a, b, &pool.posed[block.first]);
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
    if (has_friction(world, c)) {
        block.friction = static_cast<int>(place.friction);
        place.friction += 2 * m.count;
    }
    orient_normal(block, work.solver_bodies);
}

// One after the other; kinematic bodies are added to the island as they are met.
void build_in_turn(WorldData& world, IslandWorkspace& work, const std::uint32_t* slots, int count, SiIsland& island) {
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
            build_manifold(world, work, c, m, a, b, place);
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
void build_side_by_side(WorldData& world, IslandWorkspace& work, const std::uint32_t* slots, int count, SiIsland& island) {
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
                build_manifold(world, work, c, c.manifold(i), a, b, at);
            }
        }
    });
    for (const ContactPlace& at : work.places) island.has_bounce |= at.has_bounce;
}

CachedManifold& source_of(const IslandWorkspace& work, int block) {
    return *work.block_sources[block].manifold;
}

}  // namespace

void build_contact_blocks(WorldData& world, IslandWorkspace& work, const std::vector<std::uint32_t>& order, int begin, int end,
                          SiIsland& island) {
    if (work.team != nullptr && !world.has_spin_friction && world.active.kinematic.numbers().empty())
        build_side_by_side(world, work, order.data() + begin, end - begin, island);
    else
        build_in_turn(world, work, order.data() + begin, end - begin, island);
    island.contacts.end = static_cast<int>(work.contact_pool.block_count);
    island.spins.end = static_cast<int>(work.contact_pool.spins.size());
}

void store_contact_impulses(IslandWorkspace& work, const SiIsland& island) {
    if (work.is_island_wide) return work.wide_contacts.store();
    store_points(work.contact_pool, island.contacts);
    for (int k = island.spins.begin; k < island.spins.end; ++k)
        source_of(work, work.contact_pool.spins[k].block).warm_spin = work.contact_pool.spins[k].warm;
}

}  // namespace cairn
