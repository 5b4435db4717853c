// Stage 2: brings each contact up to date, cheapest way first: nobody awake → as it was; boxes too far apart → nothing; relative pose
// unchanged → reuse; else the narrow phase, for some also with a look ahead (foresight.hpp).
#include "engine/foresight.hpp"
#include "engine/reach.hpp"
#include "engine/world_data.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

// Manifolds are asked for with some margin to spare, so that a reach that grows by a hair does not end their reuse.
constexpr Real kSpare = 1.25;

void count_query(NarrowWorkspace& work, ShapeType a, ShapeType b, std::uint64_t fcl_calls) {
    const int low = static_cast<int>(std::min(a, b)), high = static_cast<int>(std::max(a, b));
    ++work.queries_of[low][high];
    work.fcl_calls_of[low][high] += static_cast<std::uint32_t>(fcl_calls);
}

Transform relative_pose(const Transform& X_WA, const Transform& X_WB) {
    return {X_WA.R.transpose() * X_WB.R, X_WA.to_local(X_WB.p)};
}

NarrowResult collide(const WorldData& world, NarrowWorkspace& work, const Contact& c, const Transform& X_WA, const Transform& X_WB,
                     Real margin, PairCache& cache, std::vector<Manifold>& out) {
    const ShapeRecord &a = world.shapes[c.shape_a], &b = world.shapes[c.shape_b];
    out.clear();
    const std::uint64_t calls_before = work.stats.fcl_calls;
    const NarrowResult result = collide_shapes({&a.shape, a.pose(X_WA)}, {&b.shape, b.pose(X_WB)}, margin, cache, out, work.stats);
    if (world.clock.on()) count_query(work, a.shape.type, b.shape.type, work.stats.fcl_calls - calls_before);
    return result;
}

// Takes into work.fresh what the pair will touch with within the step.
void foresee(const WorldData& world, NarrowWorkspace& work, const Contact& c, const Transform& X_WA, const Transform& X_WB, Real margin,
             Real dt) {
    if (work.fresh.empty()) return;
    const Body &a = world.bodies[c.body_a], &b = world.bodies[c.body_b];
    const Turning turning = turning_of(a, world.shapes[c.shape_a], b, world.shapes[c.shape_b]);
    const Foresight foresight = foresight_of(a, b, turning, work.fresh, c.size, dt);
    const auto ask_at = [&](Real t) {
        const Transform Y_WA = pose_after(a, t), Y_WB = pose_after(b, t);
        PairCache cache = c.cache;
        if (collide(world, work, c, Y_WA, Y_WB, margin, cache, work.foreseen) != NarrowResult::kTouching) return false;
        bring_back(work.foreseen, X_WA, X_WB, Y_WA, Y_WB);
        return true;
    };
    if (foresight.meeting > 0 && ask_at(foresight.meeting)) work.fresh.swap(work.foreseen);
    if (foresight.at_end && may_come_down(a, world.shapes[c.shape_a], b, world.shapes[c.shape_b], turning, work.fresh, dt) && ask_at(dt))
        add_foreseen(work.fresh, work.foreseen);
}

// Notes that a pair was found that far apart.
void prove_apart(Contact& c, const ShapeMotion& a, const ShapeMotion& b, Real gap) {
    c.apart = {a.x - b.x, gap + a.turned + b.turned};
}

// Whether a pair that was found apart cannot have come nearer than the margin since: its points have moved by no more than its bodies'
// centres have relative to each other, and what their turns add.
bool is_still_apart(const Contact& c, const ShapeMotion& a, const ShapeMotion& b, Real margin) {
    const Real way = c.apart.limit - (a.turned + b.turned) - margin;
    return way >= 0 && (a.x - b.x - c.apart.between).squaredNorm() <= way * way;
}

void ask_narrow_phase(const WorldData& world, NarrowWorkspace& work, Contact& c, const Transform& X_WA, const Transform& X_WB,
                      const ShapeMotion& motion_a, const ShapeMotion& motion_b, Real margin, Real dt) {
    const NarrowResult result = collide(world, work, c, X_WA, X_WB, margin, c.cache, work.fresh);
    if (result == NarrowResult::kFailed) {
        ContactStore::refresh(c, X_WA, X_WB);  // the last manifold stays, at the present poses
        return;
    }
    foresee(world, work, c, X_WA, X_WB, margin, dt);
    ContactStore::replace(c, work.fresh.data(), static_cast<int>(work.fresh.size()), X_WA, X_WB);
    if (c.manifold_count > 0) c.manifold(0).X_AB_query = relative_pose(X_WA, X_WB);
    c.query_margin = margin;
    c.fresh = false;
    const auto is_mesh = [&](std::uint32_t s) { return world.shapes[s].shape.type == ShapeType::kMesh; };
    if (result == NarrowResult::kSeparated && !is_mesh(c.shape_a) && !is_mesh(c.shape_b))
        prove_apart(c, motion_a, motion_b, std::max(margin, c.cache.gap));
}

// How far apart two shapes are, at least, by their boxes or balls around them; negative if that is less than the margin.
Real rough_gap(const ShapeMotion& a, const ShapeMotion& b, Real margin) {
    const Vec3 gap = (a.tight.lo - b.tight.hi).cwiseMax(b.tight.lo - a.tight.hi);
    if (gap.maxCoeff() >= margin) return gap.cwiseMax(0).norm();
    const Vec3 between = 0.5 * ((a.tight.lo + a.tight.hi) - (b.tight.lo + b.tight.hi));
    const Real reach = a.ball + b.ball + margin;
    return between.squaredNorm() >= reach * reach ? between.norm() - a.ball - b.ball : -1;  // -1 where there is no ball
}

// A contact of which nothing moves is left as it was, and not looked at.
bool rests(const WorldData& world, const Contact& c) {
    return !c.fresh && !may_move(world.bodies[c.body_a]) && !may_move(world.bodies[c.body_b]);
}

void count_contact(NarrowWorkspace& work, const Contact& c) {
    work.manifolds += static_cast<std::uint32_t>(c.manifold_count);
    work.points += static_cast<std::uint32_t>(c.point_count);
    work.max_penetration = std::max(work.max_penetration, c.deepest);
}

void pass_over(const WorldData& world, NarrowWorkspace& work, const Contact& c) {
    work.reused += static_cast<std::uint32_t>(c.manifold_count);
    if (!is_moving(world.bodies[c.body_a]) && !is_moving(world.bodies[c.body_b])) work.has_stopped = true;
    count_contact(work, c);
}

ShapeMotion motion_of(const WorldData& world, std::uint32_t shape, Real dt) {
    const ShapeRecord& record = world.shapes[shape];
    const Body& body = world.bodies[record.body];
    ShapeMotion motion = world.motions[shape];  // for its ball
    motion.v = body.v;
    motion.x = body.X_WB.p;
    motion.turned = body.turned * record.spin_radius;
    motion.reach = reach_without_way(world, body, record, dt);
    motion.moves = is_moving(body);
    motion.step = body.type == BodyType::kStatic ? ShapeMotion::kStatic : world.motion_step;
    if (record.shape.type != ShapeType::kPlane) {
        motion.tight = shape_aabb(record.shape, record.pose(body.transform()));
    } else {
        motion.tight.hi = Vec3::Constant(std::numeric_limits<Real>::infinity());
        motion.tight.lo = -motion.tight.hi;
    }
    return motion;
}

bool has_motion(const WorldData& world, std::uint32_t shape) {
    const std::uint32_t step = world.motions[shape].step;
    return step == world.motion_step || step == ShapeMotion::kStatic;
}

// The noted motion, or one that is made in `own`.
const ShapeMotion& find_motion(const WorldData& world, std::uint32_t shape, ShapeMotion& own, Real dt) {
    if (has_motion(world, shape)) return world.motions[shape];
    own = motion_of(world, shape, dt);
    return own;
}

// One that does not rest. Writes the contact, and the workspace.
void update_contact(const WorldData& world, NarrowWorkspace& work, Contact& c, std::uint32_t slot, const ShapeMotion& motion_a,
                    const ShapeMotion& motion_b, Real dt) {
    ++work.updated;
    const Body &a = world.bodies[c.body_a], &b = world.bodies[c.body_b];
    if (c.held) {
        c.held = false;
        work.released.push_back(slot);
    }
    const Real margin = pair_margin(motion_a, motion_b, dt), wide_margin = kSpare * margin;
    if (is_still_apart(c, motion_a, motion_b, margin)) return;
    if (const Real gap = rough_gap(motion_a, motion_b, wide_margin); gap >= 0) {
        ContactStore::clear(c);
        c.fresh = false;
        return prove_apart(c, motion_a, motion_b, gap);
    }
    const Transform X_WA = a.transform(), X_WB = b.transform();
    if (ContactStore::always_holds(c) || (ContactStore::may_be_reusable(c, margin) && ContactStore::is_reusable(c, X_WA, X_WB, margin))) {
        ContactStore::refresh(c, X_WA, X_WB);
        ++work.reused;
    } else {
        ask_narrow_phase(world, work, c, X_WA, X_WB, motion_a, motion_b, wide_margin, dt);
    }
    count_contact(work, c);
}

// All on this thread, in one pass.
void update_in_turn(WorldData& world, Real dt) {
    NarrowWorkspace& work = world.narrow.front();
    std::vector<Contact>& contacts = world.contacts.slots();
    const std::vector<std::uint32_t>& slots = world.active.contacts.numbers();
    for (std::size_t k = 0; k < slots.size(); ++k) {
        prefetch_ahead(contacts, slots.data(), k, slots.size());
        Contact& c = contacts[slots[k]];
        if (rests(world, c)) {
            pass_over(world, work, c);
            continue;
        }
        if (!has_motion(world, c.shape_a)) note_motion(world, world.bodies[c.body_a], dt);
        if (!has_motion(world, c.shape_b)) note_motion(world, world.bodies[c.body_b], dt);
        update_contact(world, work, c, slots[k], world.motions[c.shape_a], world.motions[c.shape_b], dt);
    }
}

// The motions of all that moves and touches something.
void note_motions(WorldData& world, Real dt) {
    constexpr std::size_t kPiece = 64;
    const std::vector<std::uint32_t>& bodies = world.active.bodies.numbers();
    for_pieces(world.team, bodies.size(), kPiece, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t k = begin; k < end; ++k)
            if (may_move(world.bodies[bodies[k]]) && world.active.contact_links.has_any(bodies[k]))
                note_motion(world, world.bodies[bodies[k]], dt);
    });
    for (const std::uint32_t i : world.active.kinematic.numbers())
        if (is_moving(world.bodies[i])) note_motion(world, world.bodies[i], dt);
}

// In pieces: a contact's update reads bodies and motions, which stay as they are meanwhile, and writes that contact.
void update_side_by_side(WorldData& world, Real dt) {
    constexpr std::size_t kPiece = 32;
    note_motions(world, dt);
    std::vector<Contact>& contacts = world.contacts.slots();
    const std::vector<std::uint32_t>& slots = world.active.contacts.numbers();
    for_pieces(world.team, slots.size(), kPiece, [&](std::size_t begin, std::size_t end, int worker) {
        NarrowWorkspace& work = world.narrow[worker];
        for (std::size_t k = begin; k < end; ++k) {
            prefetch_ahead(contacts, slots.data(), k, end);
            Contact& c = contacts[slots[k]];
            if (rests(world, c)) {
                pass_over(world, work, c);
                continue;
            }
            // What does not move may have no motion noted; then it is made here, and not kept, since others may be about to do the same.
            ShapeMotion own_a, own_b;
            update_contact(world, work, c, slots[k], find_motion(world, c.shape_a, own_a, dt), find_motion(world, c.shape_b, own_b, dt),
                           dt);
        }
    });
}

// Sums and the largest: the same whoever updated what.
void take_report(WorldData& world, NarrowWorkspace& work, StepReport& report) {
    report.manifolds += work.manifolds;
    report.contacts += work.points;
    report.manifolds_reused += work.reused;
    report.max_penetration = std::max(report.max_penetration, work.max_penetration);
    report.narrow_queries += work.stats.queries;
    report.fcl_calls += work.stats.fcl_calls;
    report.fcl_failures += work.stats.failures;
    world.active.has_stopped |= work.has_stopped;
    world.contacts_updated += work.updated;
    if (world.clock.on()) {
        StepProfile& profile = world.clock.profile();
        profile.separating_axis_hits += static_cast<std::uint32_t>(work.stats.separating_axis_hits);
        for (int a = 0; a < kShapeTypes; ++a)
            for (int b = 0; b < kShapeTypes; ++b) {
                profile.queries_of[a][b] += work.queries_of[a][b];
                profile.fcl_calls_of[a][b] += work.fcl_calls_of[a][b];
            }
    }
    // What stood beside something that moved stands no more. Not noted before: who stands must not depend on which contact comes first.
    for (const std::uint32_t slot : work.released) {
        const Contact& c = world.contacts.slots()[slot];
        world.bodies[c.body_a].stands = world.bodies[c.body_b].stands = false;
    }
    work.clear();
}

}  // namespace

void NarrowWorkspace::clear() {
    stats = {};
    manifolds = points = reused = updated = 0;
    max_penetration = 0;
    has_stopped = false;
    released.clear();
    std::fill_n(&queries_of[0][0], kShapeTypes * kShapeTypes, 0u);
    std::fill_n(&fcl_calls_of[0][0], kShapeTypes * kShapeTypes, 0u);
}

void note_motion(WorldData& world, const Body& body, Real dt) {
    for (std::uint32_t s = body.shape_begin; s < body.shape_begin + body.shape_count; ++s) world.motions[s] = motion_of(world, s, dt);
}

void update_contacts(WorldData& world, Real dt, StepReport& report) {
    refresh_active(world);
    if (++world.motion_step == ShapeMotion::kStatic) world.motion_step = 0;
    if (world.team != nullptr)
        update_side_by_side(world, dt);
    else
        update_in_turn(world, dt);
    world.contacts_updated = 0;
    for (NarrowWorkspace& work : world.narrow) take_report(world, work, report);
    report.manifolds += world.active.quiet_manifolds;
    report.contacts += world.active.quiet_points;
    world.clock.lap(Phase::kNarrowPhase);
}

}  // namespace cairn
