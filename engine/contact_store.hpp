// The manifold cache: what touches what, with the impulses of the last step, owned by the engine and part of the world's state.
//
// One contact per pair of shapes whose fat boxes overlap. Its manifolds hold their points in the bodies' frames, so that a manifold can be
// reused while the pair moves together; new points take over the impulses of the old ones that they match: by feature id, else by the
// nearest anchor. The friction impulse is kept as a world vector and projected on the new tangents.
#pragma once

#include "collision/manifold.hpp"
#include "collision/narrow_phase.hpp"
#include "engine/pair_map.hpp"
#include "solver/point_state.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace cairn {

struct alignas(64) CachedManifold {
    Transform X_AB_query;          // pose of B in A when the narrow phase was last asked; in a contact's first manifold alone
    Vec3 n = Vec3::UnitZ();        // unit, world, from B to A, at the start of the last step
    Vec3 n_local = Vec3::UnitZ();  // in the frame of the body that owns it (of B if neither does)
    NormalOwner owner = NormalOwner::kNone;
    std::uint32_t sub_key = 0;
    int count = 0;
    Vec3 warm_spin = Vec3::Zero();  // [N m s], world: what torsional and rolling friction start a substep with
    alignas(64) std::array<PointState, kMaxManifoldPoints> points;
};

// Sub-keys of manifolds that were foreseen (engine/foresight.hpp) differ by this bit from those of what was found.
constexpr std::uint32_t kForeseen = 0x80000000u;

// Where a point's surface points are: r_A on A and r_B on B, world, given the bodies' poses and the manifold's n (at these poses).
struct SurfacePoints {
    Vec3 p_a;
    Vec3 p_b;
};
SurfacePoints surface_points(const CachedManifold& manifold, const PointState& point, const Transform& X_WA, const Transform& X_WB);

// How long a pair that was found apart needs no other look: until its bodies have moved that far.
struct ApartProof {
    static constexpr Real kNone = -std::numeric_limits<Real>::infinity();
    Vec3 between = Vec3::Zero();  // [m], x_A − x_B when they were found apart
    Real limit = kNone;           // [m], how far apart, plus what turns had moved points of both by then
};

// Small, since most pairs of fat boxes do not touch, and yet each is looked at in every step; what is asked of those fills the first cache
// line. The manifolds live elsewhere.
struct alignas(64) Contact {
    std::uint32_t shape_a = 0;
    std::uint32_t shape_b = 0;
    std::uint32_t body_a = 0;
    std::uint32_t body_b = 0;
    bool alive = false;
    bool fresh = true;  // not yet asked of the narrow phase
    bool held = false;  // as it was in the last step of an island that stands (standing.cpp)
    int manifold_count = 0;
    int point_count = 0;                    // of all its manifolds
    ApartProof apart;                       // while it has none
    Real deepest = 0;                       // [m], their largest penetration, 0 if there is none
    Real size = 0;                          // [m], of the smaller shape: tolerances are relative to it
    Real mu = 0;                            // sqrt(μ_a μ_b)
    Real restitution = 0;                   // max(e_a, e_b)
    std::vector<CachedManifold> manifolds;  // the first manifold_count of them hold; keeps its memory
    Real query_margin = 0;                  // [m], the margin the narrow phase was last asked with
    PairCache cache;

    CachedManifold& manifold(int i) { return manifolds[i]; }
    const CachedManifold& manifold(int i) const { return manifolds[i]; }
};

static_assert(offsetof(Contact, deepest) == 64, "the first line tells whether a pair is apart");

// Begins to load a contact that is soon to be read, out of order: so many of its lines.
inline void prefetch_contact([[maybe_unused]] const Contact& c, [[maybe_unused]] int lines) {
#if defined(__GNUC__)
    for (int line = 0; line < lines; ++line) __builtin_prefetch(reinterpret_cast<const char*>(&c) + 64 * line);
#endif
}

// Begins to load the first manifold of a contact that is soon to be read: it may lie anywhere. (Its first point ends with the sixth line.)
inline void prefetch_manifold([[maybe_unused]] const Contact& c) {
#if defined(__GNUC__)
    if (c.manifold_count == 0) return;
    const char* first = reinterpret_cast<const char*>(c.manifolds.data());
    for (int line = 0; line < 6; ++line) __builtin_prefetch(first + 64 * line);
#endif
}
constexpr int kPrefetchAhead = 12;  // contacts

// In a loop over the contacts in slots[0, count), at its k-th: a contact first, and what hangs on it once that has come.
inline void prefetch_ahead(const std::vector<Contact>& contacts, const std::uint32_t* slots, std::size_t k, std::size_t count) {
    if (k + 2 * kPrefetchAhead < count) prefetch_contact(contacts[slots[k + 2 * kPrefetchAhead]], 2);
    if (k + kPrefetchAhead < count) prefetch_manifold(contacts[slots[k + kPrefetchAhead]]);
}

class ContactStore {
public:
    // Adds the contact of a pair of shapes; returns its slot. Slots are reused and keep their memory.
    std::uint32_t add(const Contact& contact);
    void remove(std::uint32_t shape_a, std::uint32_t shape_b);
    // The slot of a pair or PairMap::kNone.
    std::uint32_t find(std::uint32_t shape_a, std::uint32_t shape_b) const { return map_.find(key(shape_a, shape_b)); }

    // All slots, alive or not, in a fixed order.
    std::vector<Contact>& slots() { return slots_; }
    const std::vector<Contact>& slots() const { return slots_; }
    std::size_t size() const { return slots_.size() - free_.size(); }

    // True if the pair moved so little since the narrow phase was asked that its manifolds still hold. The bodies' poses and the margin are
    // those of now.
    static bool is_reusable(const Contact& contact, const Transform& X_WA, const Transform& X_WB, Real margin);
    // False where no pose would make it so.
    static bool may_be_reusable(const Contact& contact, Real margin) {
        return !contact.fresh && contact.manifold_count > 0 && margin <= contact.query_margin;
    }
    // True if its normal follows from its points, so that it holds at any poses.
    static bool always_holds(const Contact& contact) {
        return !contact.fresh && contact.manifold_count == 1 && contact.manifold(0).owner == NormalOwner::kCores;
    }
    // Brings n and the separations of a reused contact to the present poses; impulses stay.
    static void refresh(Contact& contact, const Transform& X_WA, const Transform& X_WB);
    // Takes over fresh manifolds and matches them with the old ones.
    static void replace(Contact& contact, const Manifold* fresh, int count, const Transform& X_WA, const Transform& X_WB);
    // Leaves it without manifolds.
    static void clear(Contact& contact) {
        contact.manifold_count = contact.point_count = 0;
        contact.deepest = 0;
        contact.apart = {};
    }

private:
    static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
        return a < b ? (std::uint64_t{a} << 32 | b) : (std::uint64_t{b} << 32 | a);
    }
    std::vector<Contact> slots_;
    std::vector<std::uint32_t> free_;
    PairMap map_;
};

}  // namespace cairn
