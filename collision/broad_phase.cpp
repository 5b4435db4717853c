#include "collision/broad_phase.hpp"

#include "collision/dynamic_tree.hpp"
#include "collision/pair_list.hpp"
#include "engine/base/team.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

constexpr Real kMargin = 0.05;       // of a moving proxy's largest half extent
constexpr Real kLookAhead = 2;       // displacements that a fat box reaches ahead,
constexpr Real kMaxLookAhead = 1.0;  // but no farther than this many largest half extents
constexpr Real kFarLookAhead = 32;   // the same for what flies alone
constexpr Real kMaxFarLookAhead = 16;
constexpr Real kRefitShare = 0.02;  // of a tree's leaves: if more were touched, all are fitted anew where they are

enum class Kind : std::uint8_t { kFree, kMoving, kStatic, kPlane };

struct Proxy {
    Aabb fat;
    Aabb brief;                  // while is_far: the fat box that it gets if something is in its way
    Vec3 normal = Vec3::Zero();  // plane
    Real offset = 0;             // plane
    std::uint32_t user = 0;
    int leaf = -1;  // in the tree of its kind
    Kind kind = Kind::kFree;
    bool touched = false;    // added or moved since the last update
    bool is_far = false;     // touched, alone, with a box that reaches far ahead
    std::uint64_t mark = 0;  // scratch of update_pairs
};

bool plane_reaches(const Proxy& plane, const Aabb& box) {
    const Vec3 lowest = (plane.normal.array() > 0).select(box.lo, box.hi);
    return plane.normal.dot(lowest) <= plane.offset;
}

bool overlap(const Proxy& a, const Proxy& b) {
    if (a.kind == Kind::kPlane) return plane_reaches(a, b.fat);
    if (b.kind == Kind::kPlane) return plane_reaches(b, a.fat);
    return a.fat.overlaps(b.fat);
}

// Reaches ahead by so many displacements and no farther than so many largest half extents.
Aabb reaching(const Aabb& tight, const Vec3& displacement, Real steps, Real most) {
    const Real size = 0.5 * (tight.hi - tight.lo).maxCoeff();
    const Vec3 bound = Vec3::Constant(most * size);
    const Vec3 ahead = (steps * displacement).cwiseMin(bound).cwiseMax(-bound);
    return tight.grown(kMargin * size).swept(is_finite(ahead) ? ahead : Vec3::Zero());
}

// Static proxies get no margin: they seldom move, and a margin in proportion to a wide ground would pair it with everything above.
Aabb fattened(const Aabb& tight, const Vec3& displacement, Kind kind) {
    return kind == Kind::kMoving ? reaching(tight, displacement, kLookAhead, kMaxLookAhead) : tight;
}

void sort(std::vector<ProxyPair>& pairs) {
    std::sort(pairs.begin(), pairs.end(), [](const ProxyPair& p, const ProxyPair& q) { return p.a != q.a ? p.a < q.a : p.b < q.b; });
}

}  // namespace

struct BroadPhase::Impl {
    std::vector<Proxy> proxies;
    std::vector<ProxyId> free;       // ready to be used again
    std::vector<ProxyId> removed;    // since the last update: not used again before it, so that `ended` cannot be misread
    std::vector<ProxyId> touched;    // added or moved since the last update
    std::vector<ProxyId> planes;     // ascending
    std::vector<ProxyPair> orphans;  // pairs of removed proxies
    DynamicTree moving_tree;         // apart from the static one, so that moving among statics stays cheap
    DynamicTree static_tree;
    PairList pairs;
    std::uint64_t mark = 0;
    std::uint64_t moved_count = 0;
    // What the touched proxies overlap: a range of a worker's list.
    struct Found {
        int worker = 0;
        std::size_t begin = 0, end = 0;
    };
    std::vector<Found> found;
    std::vector<std::vector<ProxyId>> overlapped;  // by worker

    DynamicTree& tree(Kind kind) { return kind == Kind::kMoving ? moving_tree : static_tree; }

    ProxyId create(Kind kind, std::uint32_t user) {
        ProxyId id;
        if (free.empty()) {
            id = static_cast<ProxyId>(proxies.size());
            proxies.emplace_back();
            pairs.add_proxy();
        } else {
            id = free.back();
            free.pop_back();
            proxies[id] = Proxy();
        }
        proxies[id].kind = kind;
        proxies[id].user = user;
        touch(id);
        return id;
    }

    void touch(ProxyId id) {
        if (proxies[id].touched) return;
        proxies[id].touched = true;
        touched.push_back(id);
    }

    // Puts what was added or moved where it belongs in its tree: one by one; or, if that is a good part of it, by fitting the boxes of the
    // tree as it is, since much that moves moves together; or, once that has worn it out, by building it anew.
    void tidy(Kind kind) {
        const auto in_tree = [&](ProxyId id) { return proxies[id].kind == kind; };
        const std::size_t count = static_cast<std::size_t>(std::count_if(touched.begin(), touched.end(), in_tree));
        if (count > kRefitShare * static_cast<Real>(tree(kind).size())) {
            if (!tree(kind).refit_all()) tree(kind).rebuild();
            return;
        }
        for (const ProxyId id : touched)
            if (in_tree(id)) tree(kind).reinsert(proxies[id].leaf);
    }

    // Everything that a proxy of this kind and box may be paired with.
    template <class Visit>
    void visit_overlapping(const Proxy& p, Visit&& visit) const {
        if (p.kind == Kind::kPlane) {
            for (ProxyId q = 0; q < static_cast<ProxyId>(proxies.size()); ++q)
                if (proxies[q].kind == Kind::kMoving && plane_reaches(p, proxies[q].fat)) visit(q);
            return;
        }
        moving_tree.query(p.fat, visit);
        if (p.kind != Kind::kMoving) return;
        static_tree.query(p.fat, visit);
        for (const ProxyId q : planes)
            if (plane_reaches(proxies[q], p.fat)) visit(q);
    }

    bool meets_anything(ProxyId p) const {
        const Aabb& box = proxies[p].fat;
        for (const ProxyId q : planes)
            if (plane_reaches(proxies[q], box)) return true;
        bool met = false;
        moving_tree.query(box, [&](ProxyId q) { met |= q != p; });
        if (!met) static_tree.query(box, [&](ProxyId) { met = true; });
        return met;
    }

    // What has something in its way gets the box that it would have beside others.
    void shorten(ProxyId p) {
        if (!proxies[p].is_far || !meets_anything(p)) return;
        proxies[p].is_far = false;
        proxies[p].fat = proxies[p].brief;
        moving_tree.shrink_box(proxies[p].leaf, proxies[p].fat);
    }

    // Everything that each touched proxy overlaps, but for what will be dealt with by another one: of two touched ones, the lower id.
    void find_overlaps(Team* team) {
        constexpr std::size_t kPiece = 32;
        found.resize(touched.size());
        overlapped.resize(team != nullptr ? static_cast<std::size_t>(team->size()) : 1);
        for (std::vector<ProxyId>& list : overlapped) list.clear();
        for_pieces(team, touched.size(), kPiece, [&](std::size_t begin, std::size_t end, int worker) {
            std::vector<ProxyId>& list = overlapped[static_cast<std::size_t>(worker)];
            for (std::size_t k = begin; k < end; ++k) {
                const ProxyId p = touched[k];
                found[k] = {worker, list.size(), list.size()};
                if (proxies[p].kind == Kind::kFree || proxies[p].is_far) continue;  // one that is far has met nothing
                visit_overlapping(proxies[p], [&](ProxyId q) {
                    if (q != p && !(proxies[q].touched && q < p)) list.push_back(q);
                });
                found[k].end = list.size();
            }
        });
    }

    template <class Accept>
    void refresh(ProxyId p, const Found& range, const Accept& accept, std::vector<ProxyPair>& begun, std::vector<ProxyPair>& ended) {
        if (proxies[p].is_far) return;  // has no partner

        // Pairs that have parted end; the partners that stay are marked.
        ++mark;
        const auto still_overlaps = [&](ProxyId q) {
            proxies[q].mark = mark;
            return overlap(proxies[p], proxies[q]);
        };
        pairs.filter(p, still_overlaps, ended);

        // Unmarked ones are new.
        for (std::size_t k = range.begin; k < range.end; ++k) {
            const ProxyId q = overlapped[static_cast<std::size_t>(range.worker)][k];
            if (proxies[q].mark == mark) continue;
            const ProxyPair pair{std::min(p, q), std::max(p, q)};
            if (!accept(proxies[pair.a].user, proxies[pair.b].user)) continue;
            pairs.add(pair);
            begun.push_back(pair);
        }
    }
};

BroadPhase::BroadPhase() : impl_(std::make_unique<Impl>()) {}
BroadPhase::~BroadPhase() = default;
BroadPhase::BroadPhase(BroadPhase&&) noexcept = default;
BroadPhase& BroadPhase::operator=(BroadPhase&&) noexcept = default;

ProxyId BroadPhase::add(const Aabb& tight, bool is_static, std::uint32_t user) {
    const Kind kind = is_static ? Kind::kStatic : Kind::kMoving;
    const ProxyId id = impl_->create(kind, user);
    Proxy& proxy = impl_->proxies[id];
    proxy.fat = fattened(tight, Vec3::Zero(), kind);
    proxy.leaf = impl_->tree(kind).insert(proxy.fat, id);
    return id;
}

ProxyId BroadPhase::add_plane(const Vec3& normal, Real offset, std::uint32_t user) {
    const ProxyId id = impl_->create(Kind::kPlane, user);
    Proxy& proxy = impl_->proxies[id];
    proxy.normal = normal;
    proxy.offset = offset;
    proxy.fat.hi = Vec3::Constant(std::numeric_limits<Real>::infinity());
    proxy.fat.lo = -proxy.fat.hi;
    impl_->planes.insert(std::lower_bound(impl_->planes.begin(), impl_->planes.end(), id), id);
    return id;
}

void BroadPhase::remove(ProxyId id) {
    Impl& s = *impl_;
    Proxy& proxy = s.proxies[id];
    s.pairs.filter(
        id, [](ProxyId) { return false; }, s.orphans);
    if (proxy.kind == Kind::kPlane)
        s.planes.erase(std::lower_bound(s.planes.begin(), s.planes.end(), id));
    else
        s.tree(proxy.kind).remove(proxy.leaf);
    proxy.kind = Kind::kFree;
    s.removed.push_back(id);
}

bool BroadPhase::stays(ProxyId id, const Aabb& tight) const {
    return impl_->proxies[id].fat.contains(tight) || !is_finite(tight.lo) || !is_finite(tight.hi);
}

bool BroadPhase::move(ProxyId id, const Aabb& tight, const Vec3& displacement, const Aabb* around) {
    Impl& s = *impl_;
    Proxy& proxy = s.proxies[id];
    if (stays(id, tight)) return false;
    proxy.fat = fattened(tight, displacement, proxy.kind);
    proxy.is_far = around != nullptr && proxy.kind == Kind::kMoving && s.pairs.is_alone(id);
    if (proxy.is_far) {
        proxy.brief = proxy.fat;
        proxy.fat = reaching(*around, displacement, kFarLookAhead, kMaxFarLookAhead).merged(proxy.brief);
    }
    s.tree(proxy.kind).set_box(proxy.leaf, proxy.fat);
    s.touch(id);
    ++s.moved_count;
    return true;
}

std::uint32_t BroadPhase::user(ProxyId id) const {
    return impl_->proxies[id].user;
}

const Aabb& BroadPhase::fat_aabb(ProxyId id) const {
    return impl_->proxies[id].fat;
}

void BroadPhase::update_pairs(const std::function<bool(std::uint32_t, std::uint32_t)>& accept, std::vector<ProxyPair>& begun,
                              std::vector<ProxyPair>& ended, Team* team) {
    Impl& s = *impl_;
    begun.clear();
    ended.clear();
    if (s.touched.empty() && s.removed.empty()) return;

    ended.insert(ended.end(), s.orphans.begin(), s.orphans.end());
    std::sort(s.touched.begin(), s.touched.end());
    s.tidy(Kind::kMoving);
    s.tidy(Kind::kStatic);
    for (const ProxyId id : s.touched)
        if (s.proxies[id].kind != Kind::kFree) s.shorten(id);
    s.find_overlaps(team);
    for (std::size_t k = 0; k < s.touched.size(); ++k)
        if (s.proxies[s.touched[k]].kind != Kind::kFree) s.refresh(s.touched[k], s.found[k], accept, begun, ended);
    for (const ProxyId id : s.touched) s.proxies[id].touched = s.proxies[id].is_far = false;

    s.free.insert(s.free.end(), s.removed.begin(), s.removed.end());
    s.touched.clear();
    s.removed.clear();
    s.orphans.clear();
    sort(begun);
    sort(ended);
}

void BroadPhase::query(const Aabb& box, std::vector<ProxyId>& out) const {
    const Impl& s = *impl_;
    out.clear();
    const auto take = [&](ProxyId id) { out.push_back(id); };
    s.moving_tree.query(box, take);
    s.static_tree.query(box, take);
    for (const ProxyId id : s.planes)
        if (plane_reaches(s.proxies[id], box)) take(id);
    std::sort(out.begin(), out.end());
}

std::size_t BroadPhase::pair_count() const {
    return impl_->pairs.count();
}

std::uint64_t BroadPhase::moved_count() const {
    return impl_->moved_count;
}

}  // namespace cairn
