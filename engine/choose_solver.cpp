#include "engine/choose_solver.hpp"

#include "engine/world_data.hpp"

#include <algorithm>
#include <limits>
#include <span>

namespace cairn {
namespace {

// Above so many bodies the direct solver is only tried on what hardly moves (what tumbles changes its active set in every step), above so
// many only as far as the island has saved what it costs, and above so many not at all. Nor on what moves and is of like masses: there the
// sweeps' errors are no greater.
constexpr int kSmallIsland = 64;
constexpr Real kLikeMasses = 5;  // of the heaviest to the lightest
constexpr int kFreeIsland = 300;
constexpr int kLargestIsland = 6000;
// Costs in products of 6 × 6 blocks, per contact point: a step of sequential impulses, the direct solver's matrix, step and pass.
constexpr double kAllowance = 7;
constexpr double kMatrixCost = 3;
constexpr double kStepCost = 0.4;
constexpr double kPassCost = 0.2;
// A block of the factor, read twice in a solve; found, when the pairs are others.
constexpr double kBlockCost = 0.35;
constexpr double kOrderingCost = 2;
constexpr double kFirstFactorisations = 3;  // of an island that has none yet: it must be able to pay as many as a first solve takes
// Steps' worth of allowance that an island starts with, and may save: the second for many bodies that are at rest, which is not solved
// again once it is found to stand. A heap that settles does not stand before long.
constexpr double kSavings = 40, kSavingsAtRest = 100;
constexpr int kLongestWait = 64;
constexpr int kLow = 8;  // contacts between the ground and anything that lies on it
// Quiet steps in a row that an island may take without coming to rest before it pays like one that moves: it creeps, and would be
// factorised in every step.
constexpr int kPatience = 4;
constexpr Real kFastSteps = 4;     // of fall, beyond whose speed a body is fast
constexpr Real kRestSteps = 1e-3;  // of fall, up to whose speed it is at rest

// A model of the textbook's, or a way of stabilising, is asked for: only sequential impulses have them.
bool asks_for_sequential_impulses(const WorldSettings& settings) {
    return !(settings.model == SiModel{}) || settings.stabilisation != Stabilisation::kSplit;
}

Real surface_speed(const Body& body) {
    return body.v.norm() + body.radius * body.w.norm();
}

// In a step.
Real speed_of_fall(const WorldData& world, const Body& body, Real dt) {
    return external_acceleration(world, body).norm() * dt;
}

Pace pace_of(const WorldData& world, int index, Real dt) {
    Pace pace = Pace::kQuiet;
    const IndexRange bodies = world.islands.bodies(index);
    for (int k = bodies.begin; k < bodies.end; ++k) {
        const Body& body = world.bodies[world.islands.body_list()[k]];
        const Real speed = surface_speed(body), of_a_step = speed_of_fall(world, body, dt);
        if (speed > kFastSteps * of_a_step) return Pace::kFast;
        if (speed > of_a_step) pace = Pace::kSlow;
    }
    return pace;
}

// By mass, since a heavy body that hits a heap counts, and a light one that flies or spins about it does not.
bool is_fast_on_average(const WorldData& world, int index, Real dt) {
    const IndexRange bodies = world.islands.bodies(index);
    Real moved = 0, fallen = 0;  // [kg m²/s²]
    for (int k = bodies.begin; k < bodies.end; ++k) {
        const Body& body = world.bodies[world.islands.body_list()[k]];
        const Real of_a_step = speed_of_fall(world, body, dt);
        moved += body.v.squaredNorm() / body.inv_mass;
        fallen += of_a_step * of_a_step / body.inv_mass;
    }
    return moved > kFastSteps * kFastSteps * fallen;
}

bool is_at_rest(const WorldData& world, int index, Real dt) {
    const IndexRange bodies = world.islands.bodies(index);
    for (int k = bodies.begin; k < bodies.end; ++k) {
        const Body& body = world.bodies[world.islands.body_list()[k]];
        if (surface_speed(body) > kRestSteps * speed_of_fall(world, body, dt)) return false;
    }
    return true;
}

bool has_like_masses(const WorldData& world, int index) {
    const IndexRange bodies = world.islands.bodies(index);
    Real least = std::numeric_limits<Real>::infinity(), most = 0;  // [1/kg]
    for (int k = bodies.begin; k < bodies.end; ++k) {
        const Real inv_mass = world.bodies[world.islands.body_list()[k]].inv_mass;
        least = std::min(least, inv_mass);
        most = std::max(most, inv_mass);
    }
    return most <= kLikeMasses * least;
}

void collect_pairs(IslandWorkspace& work, const SiIsland& island) {
    work.island_pairs.clear();
    const auto local = [&](int body) { return body >= island.body_begin && body < island.dynamic_end ? body - island.body_begin : -1; };
    for (int k = island.contacts.begin; k < island.contacts.end; ++k) {
        const int a = local(work.contact_pool.blocks[k].a), b = local(work.contact_pool.blocks[k].b);
        if (a >= 0 && b >= 0) work.island_pairs.emplace_back(a, b);
    }
}

// `is_steady`: whether it was solved in the last step, with as many contact points.
DirectState& direct_state(WorldData& world, int index, int points, double savings, bool& is_steady) {
    const std::uint32_t key = world.islands.body_list()[world.islands.bodies(index).begin];
    const auto [state_of_key, is_new] = [&] {
        const std::lock_guard lock(world.direct_mutex);
        const auto [it, added] = world.direct_states.try_emplace(key);
        return std::pair<DirectState*, bool>(&it->second, added);
    }();
    DirectState& state = *state_of_key;
    const double allowance = kAllowance * points;
    if (is_new) state.credit = savings * allowance;
    const double steps = state.stood ? static_cast<double>(world.step_count - state.last_step) : 1;
    // What fails earns less, so that a heap which never converges does not pay for ever.
    state.credit = std::min(state.credit + steps * allowance / state.penalty, savings * allowance);
    is_steady = !is_new && state.last_step + 1 == world.step_count && state.points == points;
    state.last_step = world.step_count;
    state.points = points;
    return state;
}

double factorisation_cost(const DirectState& state, int points) {
    return static_cast<double>(state.cache.factor.products()) + kMatrixCost * points;
}

void choose_by_contents(const WorldSettings& settings, const SiIsland& island, SolverPlan& plan) {
    const auto choose = [&](SolverChoice solver, SolverReason reason) {
        plan.solver = solver;
        plan.reason = reason;
    };
    if (asks_for_sequential_impulses(settings)) return choose(SolverChoice::kSi, SolverReason::kModel);
    if (takes(SolverChoice::kRattle, island)) return choose(SolverChoice::kRattle, SolverReason::kJointsAlone);
    if (takes(SolverChoice::kDirect, island)) return choose(SolverChoice::kDirect, SolverReason::kContactsAlone);
    if (takes(SolverChoice::kMixed, island)) return choose(SolverChoice::kMixed, SolverReason::kJointsAndContacts);
    choose(SolverChoice::kSi, island.has_spins() ? SolverReason::kSpinFriction : SolverReason::kBounces);
}

// Whether little can lie on anything.
bool is_low(IslandWorkspace& work, const SiIsland& island) {
    const std::span<const ContactBlock> blocks(work.contact_pool.blocks.data() + island.contacts.begin,
                                               static_cast<std::size_t>(island.contacts.end - island.contacts.begin));
    return is_shallow(blocks, island.body_begin, island.dynamic_end, kLow, work.depths);
}

// Of sweeps, for an island that moves. Errors of impacts have room. Loads that rest need all substeps, the more the more lies on them, and
// so do high ones while they sway or something flies about them; and what a kinematic body shakes is as fast as that.
int substeps_of_mover(const WorldData& world, IslandWorkspace& work, int index, const SiIsland& island, Pace pace, Real dt) {
    const int bodies = island.dynamic_end - island.body_begin, all = world.settings.substeps;
    if (bodies == 1 || island.dynamic_end != island.body_end || pace == Pace::kQuiet) return all;
    if (bodies > kSmallIsland)
        return (pace == Pace::kFast && is_fast_on_average(world, index, dt)) || is_low(work, island) ? std::max(1, all / 4) : all;
    return pace == Pace::kFast || is_low(work, island) ? std::max(1, all / 2) : all;
}

SolverPlan give_to_sweeps(SolverPlan plan, SolverReason reason) {
    plan.solver = SolverChoice::kSi;
    plan.reason = reason;
    return plan;
}

void wait_longer(DirectState& state) {
    state.wait = state.penalty;
    state.penalty = std::min(2 * state.penalty, kLongestWait);
}

}  // namespace

bool takes(SolverChoice solver, const SiIsland& island) {
    const bool contacts = island.contacts.begin < island.contacts.end, joints = !island.joints.empty();
    switch (solver) {
        case SolverChoice::kDirect:
            return contacts && !joints && !island.has_bounce && !island.has_spins();
        case SolverChoice::kRattle:
            return joints && !contacts;
        case SolverChoice::kMixed:
            return joints && contacts && !island.has_spins();
        case SolverChoice::kAuto:
        case SolverChoice::kSi:
        case SolverChoice::kTgs:
            break;
    }
    return true;
}

SolverPlan choose_solver(WorldData& world, IslandWorkspace& work, int index, const SiIsland& island, Real dt) {
    SolverPlan plan;
    plan.solver = world.settings.solver;
    plan.substeps = plan.substeps_if_wide = world.settings.substeps;
    if (island.contacts.begin < island.contacts.end) plan.pace = pace_of(world, index, dt);
    const bool forced = plan.solver != SolverChoice::kAuto, quiet = plan.pace == Pace::kQuiet;
    if (!forced) {
        choose_by_contents(world.settings, island, plan);
    }
    if (plan.solver == SolverChoice::kMixed) plan.substeps = mixed_substeps(work.solver_bodies, island, dt, MixedSettings());
    if (plan.solver != SolverChoice::kDirect || !takes(SolverChoice::kDirect, island)) return plan;
    const int bodies = island.dynamic_end - island.body_begin;
    const bool has_many = bodies > (quiet ? kLargestIsland : kSmallIsland);
    if (!forced && (has_many || (!quiet && (bodies == 1 || has_like_masses(world, index))))) {
        plan.substeps = plan.substeps_if_wide = substeps_of_mover(world, work, index, island, plan.pace, dt);
        return give_to_sweeps(plan, bodies == 1 ? SolverReason::kLoneMover : SolverReason::kLarge);
    }
    const int points = points_of(work.contact_pool, island.contacts).count();
    const bool may_bet = bodies > kFreeIsland && is_at_rest(world, index, dt);
    bool is_steady = false;
    DirectState& state = direct_state(world, index, points, may_bet ? kSavingsAtRest : kSavings, is_steady);
    if (!quiet) state.restless = 0;
    const bool charged = !forced && (!quiet || bodies > kFreeIsland || state.restless > kPatience);
    const bool tumbles = !quiet && !is_steady;  // its active set is another one in every step
    if (!forced && (tumbles || state.wait > 0 || (charged && state.credit <= 0))) {
        const bool waits = tumbles || state.wait > 0;
        // Nothing that moves by much has to be followed. A single body takes no time, and slides to a stop as closely as it can be told.
        if (quiet && bodies > 1) {
            plan.substeps = std::max(1, plan.substeps / 2);
            if (is_low(work, island)) plan.substeps_if_wide = plan.substeps;
        }
        state.wait = std::max(0, state.wait - 1);
        return give_to_sweeps(plan, waits ? SolverReason::kWaits : SolverReason::kSpent);
    }
    collect_pairs(work, island);
    const bool reordered = state.cache.set_pattern(bodies, work.island_pairs);
    if (reordered && bodies > kFreeIsland) state.credit -= kOrderingCost * static_cast<double>(state.cache.factor.blocks());
    if (charged && bodies > kFreeIsland) {
        const double affordable = state.credit / factorisation_cost(state, points);
        if (!state.cache.has_factor && affordable < kFirstFactorisations) {
            wait_longer(state);
            return give_to_sweeps(plan, SolverReason::kSpent);
        }
        plan.most_factorisations = static_cast<int>(std::clamp(affordable, 0.0, 1e6));
    }
    plan.direct = &state;
    if (quiet) plan.substeps = 1;
    return plan;
}

void note_direct(DirectState& state, int points, const DirectReport& report) {
    const BlockCholesky& factor = state.cache.factor;
    const double n = points;
    state.stood = report.stands;
    const bool rested = report.converged && report.newton_steps == 0;
    state.restless = rested ? 0 : state.restless + 1;
    if (rested) {  // not charged: what stands from then on is not either
        state.penalty = std::max(1, state.penalty / 2);
        return;
    }
    state.credit -= static_cast<double>(report.factorisations) * factorisation_cost(state, points) +
                    static_cast<double>(report.newton_steps) * (kBlockCost * static_cast<double>(factor.blocks()) + kStepCost * n) +
                    static_cast<double>(report.passes) * kPassCost * n;
    if (report.converged) {
        state.penalty = std::max(1, state.penalty / 2);
    } else {
        wait_longer(state);
    }
}

}  // namespace cairn
