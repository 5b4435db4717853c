#include "engine/contact_store.hpp"

#include <algorithm>

namespace cairn {
namespace {

// A manifold is reused while the pair has moved by less than this share of the smaller shape's size since the narrow phase saw it.
// Where a body's face owns the normal, the anchors make the separations exact whatever moved; only the outline of the touching area is off.
// Else the normal ages with the motion.
constexpr Real kReuse = 2e-3;
// A point without a partner of its own feature takes the nearest old one within this share of the size.
constexpr Real kMatchDistance = 0.1;

// The geometry of a point; its impulses stay.
void set_geometry(PointState& c, const ManifoldPoint& p, const Transform& X_WA, const Transform& X_WB) {
    c.core_a_A = X_WA.to_local(p.core_a);
    c.core_b_B = X_WB.to_local(p.core_b);
    c.radius_a = p.radius_a;
    c.radius_b = p.radius_b;
    c.separation = p.separation;
    c.feature = p.feature;
    c.normal_impulse = c.friction_impulse[0] = c.friction_impulse[1] = 0;
}

void clear_impulses(PointState& c) {
    c.warm_position = c.warm_velocity = 0;
    c.warm_friction.setZero();
    c.warm_friction_first.setZero();
    c.t1.setZero();
}

void take_impulses(PointState& to, const PointState& from) {
    to.warm_position = from.warm_position;
    to.warm_velocity = from.warm_velocity;
    to.warm_friction = from.warm_friction;
    to.warm_friction_first = from.warm_friction_first;
    to.t1 = from.t1;
}

// Points that have given, or been given, their impulses.
using PointFlags = std::array<bool, kMaxManifoldPoints>;

// Gives the points of `fresh` the impulses of those of `old` that have the same feature.
void match_features(CachedManifold& fresh, PointFlags& matched, const CachedManifold& old, PointFlags& taken) {
    for (int i = 0; i < fresh.count; ++i)
        for (int k = 0; k < old.count && !matched[i]; ++k)
            if (!taken[k] && fresh.points[i].feature == old.points[k].feature) {
                take_impulses(fresh.points[i], old.points[k]);
                taken[k] = matched[i] = true;
            }
}

// The same by distance, for those that are left.
void match_nearest(CachedManifold& fresh, PointFlags& matched, const CachedManifold& old, PointFlags& taken, Real size) {
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
        taken[best] = matched[i] = true;
    }
}

bool has_same_features(const CachedManifold& old, const Manifold& fresh) {
    if (old.count != fresh.count) return false;
    for (int k = 0; k < fresh.count; ++k)
        if (old.points[k].feature != fresh.points[k].feature) return false;
    return true;
}

// What matching needs of a manifold, and no point that does not exist.
void copy_points(CachedManifold& to, const CachedManifold& from) {
    to.n = from.n;
    to.sub_key = from.sub_key;
    to.count = from.count;
    to.warm_spin = from.warm_spin;
    std::copy(from.points.begin(), from.points.begin() + from.count, to.points.begin());
}

void set_manifold(CachedManifold& m, const Manifold& fresh, const Transform& X_WA, const Transform& X_WB) {
    m.n = fresh.n;
    m.owner = fresh.owner;
    m.n_local = (m.owner == NormalOwner::kA ? X_WA : X_WB).R.transpose() * m.n;
    m.sub_key = fresh.sub_key;
    m.count = fresh.count;
    for (int k = 0; k < m.count; ++k) set_geometry(m.points[k], fresh.points[k], X_WA, X_WB);
}

void replace_single(Contact& c, const Manifold& fresh, bool is_new, const Transform& X_WA, const Transform& X_WB) {
    CachedManifold& m = c.manifolds.front();
    if (!is_new && has_same_features(m, fresh)) {  // each point takes over from itself
        set_manifold(m, fresh, X_WA, X_WB);
        return;
    }
    static thread_local CachedManifold old;
    if (!is_new) copy_points(old, m);
    set_manifold(m, fresh, X_WA, X_WB);
    for (int k = 0; k < m.count; ++k) clear_impulses(m.points[k]);
    m.warm_spin.setZero();
    if (is_new) return;
    m.warm_spin = old.warm_spin;
    PointFlags matched{}, taken{};
    match_features(m, matched, old, taken);
    match_nearest(m, matched, old, taken, c.size);
}

// Pairs of several manifolds. Each old point's impulses go to one point at most: of the same feature before the nearest one, of the
// manifold's own key before others.
void replace_many(Contact& c, const Manifold* fresh, int count, const Transform& X_WA, const Transform& X_WB) {
    struct Matched {
        PointFlags fresh{}, old{};
    };
    static thread_local std::vector<CachedManifold> old;
    static thread_local std::vector<Matched> flags;
    const int old_count = c.manifold_count;
    if (static_cast<int>(old.size()) < old_count) old.resize(old_count);
    for (int i = 0; i < old_count; ++i) copy_points(old[i], c.manifold(i));
    flags.assign(std::max(count, old_count), {});
    for (int i = 0; i < count; ++i) {
        CachedManifold& m = c.manifold(i);
        set_manifold(m, fresh[i], X_WA, X_WB);
        for (int k = 0; k < m.count; ++k) clear_impulses(m.points[k]);
        m.warm_spin.setZero();
    }
    const auto for_each_pair = [&](auto f) {
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < old_count; ++j) f(c.manifold(i), flags[i].fresh, old[j], flags[j].old);
    };
    const auto is_same = [](const CachedManifold& a, const CachedManifold& b) { return a.sub_key == b.sub_key; };
    const auto has_come = [](const CachedManifold& a, const CachedManifold& b) { return a.sub_key == (b.sub_key ^ kForeseen); };
    for_each_pair([&](CachedManifold& m, PointFlags& matched, CachedManifold& o, PointFlags& taken) {
        if (!is_same(m, o)) return;
        std::swap(m.warm_spin, o.warm_spin);  // given once
        match_features(m, matched, o, taken);
    });
    for_each_pair([&](CachedManifold& m, PointFlags& matched, CachedManifold& o, PointFlags& taken) {
        if (has_come(m, o)) match_features(m, matched, o, taken);
    });
    for_each_pair([&](CachedManifold& m, PointFlags& matched, CachedManifold& o, PointFlags& taken) {
        if (is_same(m, o)) match_nearest(m, matched, o, taken, c.size);
    });
    constexpr Real kAlike = 0.95;  // cosine between normals
    for_each_pair([&](CachedManifold& m, PointFlags& matched, CachedManifold& o, PointFlags& taken) {
        if (is_same(m, o) || o.n.dot(m.n) <= kAlike) return;
        if (m.warm_spin.isZero(0)) std::swap(m.warm_spin, o.warm_spin);
        match_nearest(m, matched, o, taken, c.size);
    });
}

void sum_up(Contact& c) {
    c.point_count = 0;
    c.deepest = 0;
    for (int i = 0; i < c.manifold_count; ++i) {
        const CachedManifold& m = c.manifold(i);
        c.point_count += m.count;
        for (int k = 0; k < m.count; ++k) c.deepest = std::max(c.deepest, -m.points[k].separation);
    }
}

Vec3 owned_normal(const CachedManifold& m, const Transform& X_WA, const Transform& X_WB) {
    if (m.owner == NormalOwner::kCores) return direction_or(X_WA * m.points[0].core_a_A - X_WB * m.points[0].core_b_B, m.n);
    return (m.owner == NormalOwner::kA ? X_WA.R : X_WB.R) * m.n_local;
}

}  // namespace

SurfacePoints surface_points(const CachedManifold& m, const PointState& point, const Transform& X_WA, const Transform& X_WB) {
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
    std::vector<CachedManifold> kept = std::move(slots_[slot].manifolds);
    slots_[slot] = contact;
    slots_[slot].manifolds = std::move(kept);
    slots_[slot].manifolds.reserve(1);  // now, not in a later step in which the pair first touches
    slots_[slot].alive = true;
    map_.insert(key(contact.shape_a, contact.shape_b), slot);
    return slot;
}

void ContactStore::remove(std::uint32_t shape_a, std::uint32_t shape_b) {
    const std::uint32_t slot = find(shape_a, shape_b);
    if (slot == PairMap::kNone) return;
    map_.erase(key(shape_a, shape_b));
    slots_[slot].alive = false;
    clear(slots_[slot]);
    free_.push_back(slot);
}

bool ContactStore::is_reusable(const Contact& c, const Transform& X_WA, const Transform& X_WB, Real margin) {
    if (!may_be_reusable(c, margin)) return false;
    const Real distance = kReuse * c.size;
    // Where they touch: a body's origin may be far away (of a ground), and a turn moves it far.
    const Vec3& touch = c.manifold(0).points[0].core_b_B;
    const Transform& X_AB_query = c.manifold(0).X_AB_query;
    if ((X_WA.to_local(X_WB * touch) - X_AB_query * touch).squaredNorm() > distance * distance) return false;
    // ‖R − R₀‖²_F = 8 sin²(θ/2) ≈ 2 θ²
    return (X_WA.R.transpose() * X_WB.R - X_AB_query.R).squaredNorm() <= 2 * kReuse * kReuse;
}

void ContactStore::refresh(Contact& c, const Transform& X_WA, const Transform& X_WB) {
    for (int i = 0; i < c.manifold_count; ++i) {
        CachedManifold& m = c.manifold(i);
        m.n = owned_normal(m, X_WA, X_WB);
        for (int k = 0; k < m.count; ++k) {
            PointState& p = m.points[k];
            p.separation = m.n.dot(X_WA * p.core_a_A - X_WB * p.core_b_B) - p.radius_a - p.radius_b;
        }
    }
    sum_up(c);
}

void ContactStore::replace(Contact& c, const Manifold* fresh, int count, const Transform& X_WA, const Transform& X_WB) {
    if (count == 0) {
        clear(c);
        return;
    }
    if (static_cast<int>(c.manifolds.size()) < count) c.manifolds.resize(count);
    if (count == 1 && c.manifold_count <= 1)
        replace_single(c, fresh[0], c.manifold_count == 0, X_WA, X_WB);
    else
        replace_many(c, fresh, count, X_WA, X_WB);
    c.manifold_count = count;
    c.apart = {};
    sum_up(c);
}

}  // namespace cairn
