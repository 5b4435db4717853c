#include "solver/direct.hpp"

#include "solver/contact_kernel.hpp"
#include "solver/direct_problem.hpp"
#include "solver/island_probe.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

struct Context {
    SolverBodies& bodies;
    ContactPool& contacts;
    const SiIsland& island;
    const DirectSettings& settings;
    DirectCache& cache;
    DirectScratch& scratch;
    Real h;
    IslandProbe* probe;
    DirectReport report = {};
    bool polishes = false;  // residuals are solved for however small they are
};

const JointPool kNoJoints;

// After a step that changed impulses the next one has a closer look: some of the impulses stopped or moved bodies, and hold nothing.
Real enough(const Context& c) {
    if (c.polishes) return 0;
    return c.cache.disturbed ? c.settings.rest_tolerance : c.settings.start_tolerance;
}

// A solve that ended above the tolerance goes on from where it is with sequential impulses, if so many are allowed. False: the step cannot
// be gone on with.
template <typename Sweep>
bool solve_or_sweep(Context& c, DirectGoal goal, Sweep sweep) {
    DirectReport solve;
    // What an earlier solve of the step has changed is followed however small the residual.
    const bool follows = goal == DirectGoal::kVelocities && c.report.newton_steps > 0;
    const bool converged = direct_solve(c.bodies, c.contacts, c.island, goal, c.h, c.settings, c.cache, c.scratch, solve,
                                        follows ? c.settings.tolerance : enough(c));
    c.report.factorisations += solve.factorisations;
    c.report.newton_steps += solve.newton_steps;
    c.report.passes += solve.passes;
    c.report.residual = std::max(c.report.residual, solve.residual);
    if (converged) return true;
    c.report.converged = false;
    for (int k = 0; k < c.settings.rescue_sweeps; ++k) sweep();
    c.report.si.contact_sweeps += static_cast<std::uint64_t>(c.settings.rescue_sweeps);
    return c.settings.rescue_sweeps > 0;
}

void save_velocities(Context& c) {
    const auto begin = c.bodies.velocity.begin();
    c.scratch.saved_velocity.assign(begin + c.island.body_begin, begin + c.island.body_end);
}

// What a kick and a warm start do not change.
void save_rest(Context& c) {
    const PointRange p = points_of(c.contacts, c.island.contacts);
    c.scratch.saved_motion.assign(c.bodies.motion.begin() + c.island.body_begin, c.bodies.motion.begin() + c.island.body_end);
    c.scratch.saved_warm.assign(c.contacts.warm.begin() + p.begin, c.contacts.warm.begin() + p.end);
}

void take_back(Context& c) {
    const PointRange p = points_of(c.contacts, c.island.contacts);
    std::copy(c.scratch.saved_motion.begin(), c.scratch.saved_motion.end(), c.bodies.motion.begin() + c.island.body_begin);
    std::copy(c.scratch.saved_velocity.begin(), c.scratch.saved_velocity.end(), c.bodies.velocity.begin() + c.island.body_begin);
    std::copy(c.scratch.saved_warm.begin(), c.scratch.saved_warm.end(), c.contacts.warm.begin() + p.begin);
    std::fill(c.contacts.impulse.begin() + p.begin, c.contacts.impulse.begin() + p.end, PointImpulse{});
    std::fill(c.contacts.total.begin() + p.begin, c.contacts.total.begin() + p.end, PointImpulse{});
    for (int k = c.island.contacts.begin; k < c.island.contacts.end; ++k) build_block(c.contacts, c.contacts.blocks[k], c.bodies);
    c.report.taken_back = true;
}

bool drift_pushed(Context& c) {
    const int begin = c.island.body_begin, end = c.island.dynamic_end;
    hold_contacts(c.contacts, c.island.contacts, c.bodies);
    if (c.probe) c.probe->note_solve(SolveTurn::kFirst, c.bodies, c.contacts, kNoJoints);
    begin_push(c.bodies, begin, end);
    if (!solve_or_sweep(c, DirectGoal::kPush,
                        [&] { push_contacts(c.contacts, c.island.contacts, c.bodies, c.h, c.settings.contact_push); }))
        return false;
    measure_push(c.bodies, begin, end);
    c.report.si.rotor_calls += drift(c.bodies, begin, end, c.h);
    drift_kinematic(c.bodies, end, c.island.body_end, c.h);
    advance_blocks(c.contacts, c.island.contacts, c.bodies, c.h, admitted_lag(c.settings.rebuild_angle, c.h));
    release_contacts(c.contacts, c.island.contacts);
    end_push(c.bodies, begin, end);
    if (c.probe) c.probe->note_drift(c.bodies, true);
    return true;
}

// What a solve that ended on its tolerance leaves of friction over μ λ_N goes back to the velocities: the bound holds to the last digit.
void return_excess_friction(Context& c) {
    for (int k = c.island.contacts.begin; k < c.island.contacts.end; ++k) {
        const ContactBlock& block = c.contacts.blocks[k];
        for (int i = 0; block.friction >= 0 && i < block.count; ++i) {
            PointImpulse& impulse = c.contacts.impulse[block.first + i];
            const Real bound = block.mu * impulse.normal;
            for (int j = 0; j < 2; ++j) {
                if (std::abs(impulse.friction[j]) <= bound) continue;
                const FrictionRow& row = c.contacts.frictions[block.friction + 2 * i + j];
                const Real within = std::copysign(bound, impulse.friction[j]);
                BlockVelocity u(block, c.bodies);
                u.apply(block, row.t, row, within - impulse.friction[j]);
                u.store(block, c.bodies);
                impulse.friction[j] = within;
            }
        }
    }
}

// In a step of one substep a body that rests bears the same load before the drift and after it. What one solve adds to close a gap and
// the other takes away again must not be there from the start of the next step.
void share_evenly(ContactPool& contacts, BlockRange range) {
    const PointRange points = points_of(contacts, range);
    for (int p = points.begin; p < points.end; ++p) {
        WarmImpulse& warm = contacts.warm[p];
        warm.position = warm.velocity = 0.5 * (warm.position + warm.velocity);
    }
}

// Contacts without a history are expected to bear in the second half of the step what they bear in the first, within their bounds.
void expect_the_same(ContactPool& contacts, BlockRange range) {
    for (int k = range.begin; k < range.end; ++k) {
        const ContactBlock& block = contacts.blocks[k];
        for (int p = block.first; p < block.first + block.count; ++p) {
            WarmImpulse& warm = contacts.warm[p];
            if (warm.position != 0 || warm.velocity != 0) continue;
            const PointImpulse& impulse = contacts.impulse[p];
            warm.velocity = impulse.normal;
            for (int j = 0; block.friction >= 0 && j < 2; ++j) {
                const Real bound = 2 * block.mu * impulse.normal;
                warm.friction_first[j] = impulse.friction[j];
                warm.friction[j] = std::clamp(2 * impulse.friction[j], -bound, bound);
            }
        }
    }
}

bool stands_still(const Context& c) {
    const Real least = exact_correction(c.bodies, c.island, c.h);
    for (int i = c.island.body_begin; i < c.island.dynamic_end; ++i) {
        const BodyVelocity& u = c.bodies.velocity[i];
        if (u.v.norm() + c.bodies.motion[i].radius * u.w.norm() > least) return false;
    }
    return true;
}

bool substep(Context& c, bool is_first) {
    const BlockRange range = c.island.contacts;
    const bool whole_step = c.settings.substeps == 1;
    if (c.probe) c.probe->begin_substep(c.bodies, c.h);
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, 0.5 * c.h);
    warm_start_first(c.contacts, range, c.bodies);
    if (whole_step) {
        const Rest rest = rests(c.bodies, c.contacts, c.island, c.h, c.scratch.saved_velocity, enough(c), !c.cache.polished, c.report);
        if (rest == Rest::kYes) {
            if (c.probe) c.probe->measure(c.bodies, c.contacts, c.contacts.total, kNoJoints);
            return true;
        }
        c.polishes = rest == Rest::kNearly;
    }
    if (is_first && c.settings.rescue_sweeps == 0) save_rest(c);
    if (!solve_or_sweep(c, DirectGoal::kGaps, [&] { sweep_contact_gaps(c.contacts, range, c.bodies, c.h); })) return false;
    const bool is_alone =
        c.island.dynamic_end - c.island.body_begin == 1;  // its solve takes no time, and may end elsewhere in its tolerance
    if (whole_step && !is_alone) expect_the_same(c.contacts, range);
    if (!drift_pushed(c)) return false;
    kick(c.bodies, c.island.body_begin, c.island.dynamic_end, 0.5 * c.h);
    warm_start_second(c.contacts, range, c.bodies);
    if (!solve_or_sweep(c, DirectGoal::kVelocities, [&] { sweep_contact_velocities(c.contacts, range, c.bodies); })) return false;
    return_excess_friction(c);
    if (c.probe) {
        c.probe->note_solve(SolveTurn::kSecond, c.bodies, c.contacts, kNoJoints);
        c.probe->measure(c.bodies, c.contacts, c.contacts.impulse, kNoJoints);
    }
    const bool still = whole_step && stands_still(c);
    close_contact_substep(c.contacts, range, still ? FirstFriction::kHalf : FirstFriction::kHeld);
    if (still) share_evenly(c.contacts, range);
    return true;
}

}  // namespace

bool DirectCache::set_pattern(int bodies, const std::vector<std::pair<int, int>>& new_pairs) {
    if (bodies == bodies_ && new_pairs == pairs) return false;
    bodies_ = bodies;
    pairs = new_pairs;
    factor.analyse(bodies, pairs);
    has_factor = false;
    weight_scale = 1;
    return true;
}

void DirectCache::add_to(Hasher& hasher) const {
    hasher.add_word(disturbed);
    hasher.add_word(polished);
    hasher.add_word(has_factor);
    hasher.add(weight_scale);
    if (!has_factor) return;
    for (const Real value : factor.values()) hasher.add(value);
    for (const char state : factored_active) hasher.add_word(static_cast<std::uint64_t>(state));
}

DirectReport solve_island_direct(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island, Real dt,
                                 const DirectSettings& settings, DirectCache& cache, IslandProbe* probe) {
    static thread_local DirectScratch scratch;
    Context c{bodies, contacts, island, settings, cache, scratch, dt / settings.substeps, probe, {}};
    bodies.push.resize(bodies.velocity.size());
    save_velocities(c);
    scratch.factorisations_left = settings.most_factorisations;
    for (int k = 0; k < settings.substeps; ++k) {
        if (!substep(c, k == 0)) {
            take_back(c);
            break;
        }
    }
    cache.disturbed = c.report.newton_steps > 0;
    if (cache.disturbed) cache.polished = c.polishes;
    return c.report;
}

}  // namespace cairn
