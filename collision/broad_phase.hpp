// Broad phase: which shapes may touch. Fat boxes in a dynamic bounding volume tree, and a persistent set of overlapping pairs;
// only a proxy that has left its fat box is touched again. Two proxies are a pair exactly while their fat boxes overlap (or the fat box
// reaches into the half-space) and `accept` agreed when they met; the tree's shape and history have no say in it.
//
// A moving proxy's fat box is its tight one grown by 5 % of its largest half extent and, when it has moved, stretched along the
// displacement; a static proxy's is the tight one itself. One that has no partner and meets nothing there gets a far longer box, so that
// what flies alone is seldom touched. Ids must be valid (not checked). Allocates only to grow beyond the largest size so far.
#pragma once

#include "collision/aabb.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace cairn {

class Team;

using ProxyId = std::int32_t;
constexpr ProxyId kNoProxy = -1;

// Two overlapping proxies, a < b.
struct ProxyPair {
    ProxyId a = kNoProxy;
    ProxyId b = kNoProxy;
};

class BroadPhase {
public:
    BroadPhase();
    ~BroadPhase();
    BroadPhase(BroadPhase&&) noexcept;
    BroadPhase& operator=(BroadPhase&&) noexcept;

    // `user` is given back by user(id). `is_static`: never paired with another static proxy.
    ProxyId add(const Aabb& tight, bool is_static, std::uint32_t user);
    // The half-space normal·x <= offset [m], world frame. Always static.
    ProxyId add_plane(const Vec3& normal, Real offset, std::uint32_t user);
    // Its pairs are reported as ended by the next update_pairs; until then user(id) still answers and the id is not given out again.
    void remove(ProxyId id);

    // Tells where the proxy is now. `tight` is what must stay covered (already grown by the caller's contact margin);
    // `displacement` is where it is expected to move next [m]. Returns false, having done nothing, while `tight` is inside the fat box
    // (or not finite). `around`: covers the proxy however it turns; may be given for one that flies freely, for which the fat box then
    // reaches far ahead if nothing is there.
    bool move(ProxyId id, const Aabb& tight, const Vec3& displacement, const Aabb* around = nullptr);

    // Whether move() would do nothing. May be asked by several threads at once.
    bool stays(ProxyId id, const Aabb& tight) const;

    std::uint32_t user(ProxyId id) const;
    const Aabb& fat_aabb(ProxyId id) const;

    // Brings the pair set up to date with the moves since the last call. `begun` and `ended` are cleared and filled, each in ascending
    // order of (a, b), so the result does not depend on the tree's history. `accept` filters new pairs (by user data, that of the lower id
    // first); a refused pair is asked about again when one of the two has been moved. Costs nothing when nothing was added, moved or
    // removed. With a team, the search is shared out; the result is the same.
    void update_pairs(const std::function<bool(std::uint32_t, std::uint32_t)>& accept, std::vector<ProxyPair>& begun,
                      std::vector<ProxyPair>& ended, Team* team = nullptr);

    // Every proxy whose fat box overlaps the box (and every plane that reaches into it), in ascending order; `out` is cleared first.
    void query(const Aabb& box, std::vector<ProxyId>& out) const;

    std::size_t pair_count() const;
    std::uint64_t moved_count() const;  // proxies re-inserted by move() since construction

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace cairn
