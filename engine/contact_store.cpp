#include "engine/contact_store.hpp"

#include <algorithm>

namespace cairn {
namespace {

// A manifold is reused while the pair has moved by less than these shares of the smaller shape's size since the narrow phase saw it.
// Where a body's face owns the normal, the anchors make the separations exact whatever moved; only the outline of the touching area is off.
// Else the normal itself ages, and hardly any motion is let pass.
constexpr Real kReuseOwned = 2e-3;
constexpr Real kReuseUnowned = 1e-6;
// A point without a partner of its own feature takes the nearest old one within this share of the size.
constexpr Real kMatchDistance = 0.1;

CachedPoint to_cached(const ManifoldPoint& p, const Transform& X_WA, const Transform& X_WB) {
    CachedPoint c;
    c.core_a_A = X_WA.to_local(p.core_a);
    c.core_b_B = X_WB.to_local(p.core_b);
    c.radius_a = p.radius_a;
    c.radius_b = p.radius_b;
    c.separation = p.separation;
    c.feature = p.feature;
    return c;
}

void take_impulses(CachedPoint& to, const CachedPoint& from) {
    to.warm_position = from.warm_position;
    to.warm_velocity = from.warm_velocity;
    to.warm_friction = from.warm_friction;
    to.warm_friction_first = from.warm_friction_first;
    to.t1 = from.t1;
}

// Gives the points of `fresh` the impulses of those of `old`: by feature, then by distance.
void match_points(CachedManifold& fresh, const CachedManifold& old, Real size) {
    bool taken[kMaxManifoldPoints] = {}, matched[kMaxManifoldPoints] = {};
    for (int i = 0; i < fresh.count; ++i)
        for (int k = 0; k < old.count && !matched[i]; ++k)
            if (!taken[k] && fresh.points[i].feature == old.points[k].feature) {
                take_impulses(fresh.points[i], old.points[k]);
                taken[k] = matched[i] = true;
            }
    const Real reach = kMatchDistance * size;
    for (int i = 0; i < fresh.count; ++i) {
        if (matched[i]) continue;
        Real nearest = reach * reach;
        int best = -1;
        for (int k = 0; k < old.count; ++k) {
            const Real d = std::min((fresh.points[i].core_a_A - old.points[k].core_a_A).squaredNorm(),
                                    (fresh.points[i].core_b_B - old.points[k].core_b_B).squaredNorm());
            if (!taken[k] && d < nearest) nearest = d, best = k;
        }
        if (best < 0) continue;
        take_impulses(fresh.points[i], old.points[best]);
        taken[best] = true;
    }
}

Vec3 owned_normal(const CachedManifold& m, const Transform& X_WA, const Transform& X_WB) {
    if (m.owner == NormalOwner::kCores) return direction_or(X_WA * m.points[0].core_a_A - X_WB * m.points[0].core_b_B, m.n);
    return (m.owner == NormalOwner::kA ? X_WA.R : X_WB.R) * m.n_local;
}

}  // namespace

SurfacePoints surface_points(const CachedManifold& m, const CachedPoint& point, const Transform& X_WA, const Transform& X_WB) {
    const Vec3 core_a = X_WA * point.core_a_A, core_b = X_WB * point.core_b_B;
    const Real separation = m.n.dot(core_a - core_b) - point.radius_a - point.radius_b;
    if (m.owner == NormalOwner::kA) {
        const Vec3 p_b = core_b + point.radius_b * m.n;
        return {p_b + separation * m.n, p_b};
    }
    const Vec3 p_a = core_a - point.radius_a * m.n;
    return {p_a, p_a - separation * m.n};
}

std::uint32_t ContactStore::add(const Contact& contact) {
    std::uint32_t slot;
    if (free_.empty()) {
        slot = static_cast<std::uint32_t>(slots_.size());
        slots_.emplace_back();
        free_.reserve(slots_.capacity());  // so that remove() never allocates
    } else {
        slot = free_.back();
        free_.pop_back();
    }
    std::vector<CachedManifold> kept = std::move(slots_[slot].extra);
    slots_[slot] = contact;
    slots_[slot].extra = std::move(kept);
    slots_[slot].alive = true;
    map_.insert(key(contact.shape_a, contact.shape_b), slot);
    return slot;
}

void ContactStore::remove(std::uint32_t shape_a, std::uint32_t shape_b) {
    const std::uint32_t slot = find(shape_a, shape_b);
    if (slot == PairMap::kNone) return;
    map_.erase(key(shape_a, shape_b));
    slots_[slot].alive = false;
    slots_[slot].manifold_count = 0;
    free_.push_back(slot);
}

bool ContactStore::is_reusable(const Contact& c, const Transform& X_AB, Real margin) {
    if (c.fresh || c.manifold_count == 0 || margin > c.query_margin) return false;
    bool owned = true;
    for (int i = 0; i < c.manifold_count; ++i) owned &= c.manifold(i).owner != NormalOwner::kNone;
    const Real share = owned ? kReuseOwned : kReuseUnowned, distance = share * c.size;
    if ((X_AB.p - c.X_AB_query.p).squaredNorm() > distance * distance) return false;
    // ‖R − R₀‖²_F = 8 sin²(θ/2) ≈ 2 θ²
    return (X_AB.R - c.X_AB_query.R).squaredNorm() <= 2 * share * share;
}

void ContactStore::refresh(Contact& c, const Transform& X_WA, const Transform& X_WB) {
    for (int i = 0; i < c.manifold_count; ++i) {
        CachedManifold& m = c.manifold(i);
        m.n = owned_normal(m, X_WA, X_WB);
        for (int k = 0; k < m.count; ++k) {
            CachedPoint& p = m.points[k];
            p.separation = m.n.dot(X_WA * p.core_a_A - X_WB * p.core_b_B) - p.radius_a - p.radius_b;
        }
    }
}

void ContactStore::replace(Contact& c, const Manifold* fresh, int count, const Transform& X_WA, const Transform& X_WB) {
    const int old_count = c.manifold_count;
    const bool single = old_count <= 1 && count <= 1;
    CachedManifold old_first = c.first;
    std::vector<CachedManifold> old_extra;
    if (!single) old_extra = c.extra;  // mesh pairs only
    if (static_cast<int>(c.extra.size()) < count - 1) c.extra.resize(count - 1);
    for (int i = 0; i < count; ++i) {
        CachedManifold& m = c.manifold(i);
        m.n = fresh[i].n;
        m.owner = fresh[i].owner;
        m.n_local = (m.owner == NormalOwner::kA ? X_WA : X_WB).R.transpose() * m.n;
        m.sub_key = fresh[i].sub_key;
        m.count = fresh[i].count;
        for (int k = 0; k < m.count; ++k) m.points[k] = to_cached(fresh[i].points[k], X_WA, X_WB);
        for (int j = 0; j < old_count; ++j) {
            const CachedManifold& old = j == 0 ? old_first : old_extra[j - 1];
            if (single || old.sub_key == m.sub_key || old.n.dot(m.n) > 0.95) {
                match_points(m, old, c.size);
                break;
            }
        }
    }
    c.manifold_count = count;
}

}  // namespace cairn
