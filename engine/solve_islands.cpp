// Stages 3 and 4: groups what is tied together, builds rows per island, solves, takes the results back.
#include "engine/error_control.hpp"
#include "engine/world_data.hpp"
#include "solver/point_load.hpp"
#include "solver/spin_rows.hpp"
#include "solver/tgs.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// [m/s]: what a solve may leave. Left in every step, a velocity makes its size of position error in a second.
Real solve_tolerance(const WorldSettings& s) {
    return s.tolerance > 0 ? std::min(s.residual_tolerance, 0.1 * s.tolerance) : s.residual_tolerance;
}

// Most sweeps of a solve: with a tolerance, enough for all that converges.
int most_sweeps(const WorldSettings& s, int asked) {
    constexpr int kEnough = 200;
    return s.tolerance > 0 ? std::max(asked, kEnough) : asked;
}

SiSettings si_settings(const WorldSettings& s, int substeps) {
    SiSettings out;
    out.substeps = substeps;
    out.iterations = most_sweeps(s, s.iterations);
    out.residual_tolerance = solve_tolerance(s);
    out.stabilisation = s.stabilisation;
    out.model = s.model;
    return out;
}

void add_dynamic(WorldData& world, IslandWorkspace& work, std::uint32_t index) {
    const Body& body = world.bodies[index];
    BodyMotion m;
    m.x = body.X_WB.p;
    m.q = body.X_WB.q;
    m.R = body.R;
    m.inv_mass = body.inv_mass;
    m.inv_inertia_B = body.inv_inertia_B;
    m.inv_inertia_W = body.R * body.inv_inertia_B * body.R.transpose();
    m.acceleration = external_acceleration(world, body);
    m.torque = body.torque;
    m.radius = body.radius;
    m.rotor = body.rotor;
    work.solver_index[index] = work.solver_bodies.size();
    work.solver_bodies.motion.push_back(m);
    work.solver_bodies.velocity.push_back({body.v, body.w});
}

SiIsland build_island(WorldData& world, IslandWorkspace& work, int index) {
    const IslandBuilder& islands = world.islands;
    SiIsland island;
    island.body_begin = work.solver_bodies.size();
    const IndexRange bodies = islands.bodies(index);
    for (int k = bodies.begin; k < bodies.end; ++k) add_dynamic(world, work, islands.body_list()[k]);
    island.dynamic_end = island.body_end = work.solver_bodies.size();

    build_joint_blocks(world, work, index, island);

    island.contacts.begin = static_cast<int>(work.contact_pool.block_count);
    island.spins.begin = static_cast<int>(work.contact_pool.spins.size());
    const IndexRange contacts = islands.items(index, IslandBuilder::kContact);
    build_contact_blocks(world, work, islands.item_list(IslandBuilder::kContact), contacts.begin, contacts.end, island);
    for (std::uint32_t body : work.kinematic_used) work.solver_index[body] = -1;
    work.kinematic_used.clear();
    for (int k = bodies.begin; k < bodies.end; ++k) work.solver_index[islands.body_list()[k]] = -1;
    return island;
}

void store_bodies(WorldData& world, IslandWorkspace& work, IndexRange bodies, int solver_begin) {
    constexpr std::size_t kPiece = 64;
    const std::size_t count = static_cast<std::size_t>(bodies.end - bodies.begin);
    for_pieces(work.team, count, kPiece, [&](std::size_t begin, std::size_t end, int worker) {
        for (std::size_t k = begin; k < end; ++k) {
            const BodyMotion& m = work.solver_bodies.motion[solver_begin + k];
            const BodyVelocity& u = work.solver_bodies.velocity[solver_begin + k];
            const std::uint32_t body = world.islands.body_list()[bodies.begin + k];
            world.bodies[body].stands = false;
            IslandWorkspace& own = work.team != nullptr ? world.workspaces[worker] : work;
            if (!accept_state(world.bodies[body], {m.q, m.x}, u.v, u.w)) own.broken.push_back(body);
        }
    });
}

void store_island(WorldData& world, IslandWorkspace& work, int index, const SiIsland& island) {
    if (!work.island_stands) store_bodies(world, work, world.islands.bodies(index), island.body_begin);
    store_contact_impulses(work, island);
    if (work.island_stands) return note_standing(world, index);
    store_joint_impulses(world, work, island);
}

// With diagnostics: what follows the solve of an island, from its beginning.
IslandProbe* begin_probe(const WorldData& world, IslandWorkspace& work, const SiIsland& island) {
    if (!world.settings.diagnostics) return nullptr;
    work.probe.begin(island, world.settings.model.friction);
    return &work.probe;
}

bool solve_by_rattle(WorldData& world, IslandWorkspace& work, const SiIsland& island, Real dt, int level, SiReport& counts,
                     IslandReport& island_report) {
    RattleSettings settings;
    settings.warm_step = dt / world.settings.substeps;
    settings.level = level;
    if (level >= 0) settings.max_substeps <<= level;
    const RattleReport solved =
        solve_island_rattle(work.rattle, work.solver_bodies, work.joint_pool, island, dt, settings, begin_probe(world, work, island));
    island_report.iterations = static_cast<std::uint64_t>(solved.iterations);
    counts.rotor_calls += solved.rotor_calls;
    counts.joint_sweeps += solved.iterations + solved.factorisations;  // each is a pass over the rows
    return solved.ok();
}

bool solve_mixed(WorldData& world, IslandWorkspace& work, const SiIsland& island, Real dt, const SolverPlan& plan, SiReport& counts,
                 StepReport& report, IslandReport& island_report) {
    MixedSettings settings;
    settings.substeps = plan.substeps;
    settings.sweeps = most_sweeps(world.settings, settings.sweeps);
    settings.residual_tolerance = solve_tolerance(world.settings);
    const MixedReport solved = solve_island_mixed(work.mixed, work.solver_bodies, work.contact_pool, work.joint_pool, island, dt, settings,
                                                  begin_probe(world, work, island));
    island_report.iterations = solved.si.contact_sweeps;
    counts.add(solved.si);
    counts.joint_sweeps += solved.joint_solves + solved.factorisations;  // each is a pass over the rows
    report.factorisations += solved.factorisations;
    return solved.failure == MixedFailure::kNone;
}

// False: it did not converge and the island is as it was. One that is forced goes on with sweeps.
bool solve_directly(WorldData& world, IslandWorkspace& work, const SiIsland& island, Real dt, const SolverPlan& plan, SiReport& counts,
                    StepReport& report, IslandReport& island_report) {
    DirectSettings settings;
    settings.substeps = plan.substeps;
    settings.most_factorisations = plan.most_factorisations;
    if (work.team != nullptr && work.team->size() <= BlockCholesky::kMostWorkers) settings.team = work.team;
    if (world.settings.solver == SolverChoice::kDirect) settings.rescue_sweeps = 10;
    const DirectReport solved = solve_island_direct(work.solver_bodies, work.contact_pool, island, dt, settings, plan.direct->cache,
                                                    begin_probe(world, work, island));
    island_report.iterations = solved.newton_steps;
    note_direct(*plan.direct, points_of(work.contact_pool, island.contacts).count(), solved);
    report.factorisations += solved.factorisations;
    counts.add(solved.si);
    counts.contact_sweeps += solved.passes;
    work.island_stands = solved.stands;
    if (!solved.taken_back) counts.residual = std::max(counts.residual, solved.residual);
    return !solved.taken_back;
}

void scale_warm_impulses(IslandWorkspace& work, const SiIsland& island, Real scale) {
    if (scale == 1) return;
    scale_warm_start(work.contact_pool, island.contacts, scale);
    scale_warm_spins(work.contact_pool, island.spins, scale);
    scale_warm_start(work.joint_pool, island.joints, scale);
}

// Sweeps that are few begin with impulses that carry what weighs on them. Those of an impact do not, nor do those of bodies wedged in
// between others, which a direct solve may leave far larger: they held each other where they were found, and set the bodies in motion now
// that these have turned.
void limit_warm_impulses(IslandWorkspace& work, const SiIsland& island, Real h, bool wide) {
    constexpr Real kMostLeverage = 30;  // of wedges, arches and levers, over the impulse of all external forces
    if (island.contacts.begin == island.contacts.end) return;
    Real external = 0;  // [N s]
    for (int i = island.body_begin; i < island.dynamic_end; ++i) {
        const BodyMotion& m = work.solver_bodies.motion[i];
        external += h * (m.acceleration.norm() / m.inv_mass + m.torque.norm() / m.radius);
    }
    const Real largest = wide ? work.wide_contacts.largest_warm() : largest_warm(work.contact_pool, island.contacts);
    if (largest <= kMostLeverage * external) return;
    const Real scale = kMostLeverage * external / largest;
    if (wide) return work.wide_contacts.scale_warm(scale);
    scale_warm_start(work.contact_pool, island.contacts, scale);
    scale_warm_spins(work.contact_pool, island.spins, scale);
}

// Lets more contacts be swept side by side, where that leaves the order in which loads are carried.
void spread_contacts(IslandWorkspace& work, const SiIsland& island) {
    if (!work.block_order.spread(work.contact_pool, island.contacts, island.body_begin, island.dynamic_end)) return;
    work.unsorted_sources = work.block_sources;
    for (int k = island.contacts.begin; k < island.contacts.end; ++k)
        work.block_sources[k] = work.unsorted_sources[island.contacts.begin + work.block_order.source(k - island.contacts.begin)];
}

// Into the lanes of the wide kernels, or into the pool.
void take_over_points(const WorldData& world, IslandWorkspace& work, const SiIsland& island, Real dt, Real warm_scale, bool wide) {
    const PointLoad load{dt, world.settings.model.friction, warm_scale};
    if (wide)
        work.wide_contacts.pack(work.contact_pool, work.solver_bodies, island.body_begin, island.body_end, load);
    else
        load_points(work.contact_pool, island.contacts, work.solver_bodies, load);
    if (warm_scale == 1) return;
    scale_warm_spins(work.contact_pool, island.spins, warm_scale);
    scale_warm_start(work.joint_pool, island.joints, warm_scale);
}

// False: a solver was forced that cannot solve this island; bodies and joints are as they were. `scale` is that of the warm impulses;
// `level`: of refinement (engine/error_control.hpp), or kUncontrolled.
bool solve_island(WorldData& world, IslandWorkspace& work, int index, const SiIsland& island, Real dt, Real scale, int level,
                  IslandReport& island_report) {
    SolverPlan plan = choose_solver(world, work, index, island, dt);
    island_report.solver = plan.solver;
    island_report.reason = plan.reason;
    if (!takes(plan.solver, island)) return false;
    const int default_substeps = level < 0 ? world.settings.substeps : 1 << level;
    if (level >= 0 && plan.solver != SolverChoice::kRattle) plan.substeps = plan.substeps_if_wide = default_substeps;
    SolverChoice solver = plan.solver;
    SiSettings settings = si_settings(world.settings, default_substeps);
    if (solver == SolverChoice::kSi && may_go_wide(island, settings)) spread_contacts(work, island);
    const bool wide = work.is_island_wide =
        solver == SolverChoice::kSi && plan_wide(work.wide_contacts, work.contact_pool, island, settings, &work.solver_bodies, work.team);
    int substeps = wide ? plan.substeps_if_wide : plan.substeps;
    // The cache holds the impulses of a substep of the default length.
    take_over_points(world, work, island, dt, scale * world.settings.substeps / substeps, wide);
    if (solver == SolverChoice::kSi || solver == SolverChoice::kTgs) limit_warm_impulses(work, island, dt / substeps, wide);
    if (!wide) build_contacts(work.contact_pool, island.contacts, work.solver_bodies);
    const auto sweep_instead = [&] {
        scale_warm_impulses(work, island, static_cast<Real>(substeps) / default_substeps);
        solver = SolverChoice::kSi;
        substeps = default_substeps;
        limit_warm_impulses(work, island, dt / substeps, false);
    };
    if (solver == SolverChoice::kDirect && !solve_directly(world, work, island, dt, plan, work.solved, work.report, island_report))
        sweep_instead();
    if (solver == SolverChoice::kRattle && !solve_by_rattle(world, work, island, dt, level, work.solved, island_report)) {
        if (world.settings.solver == SolverChoice::kRattle) return false;
        sweep_instead();
    }
    if (solver == SolverChoice::kMixed && !solve_mixed(world, work, island, dt, plan, work.solved, work.report, island_report)) {
        if (world.settings.solver == SolverChoice::kMixed) return false;
        sweep_instead();
    }
    if (solver == SolverChoice::kSi || solver == SolverChoice::kTgs) {
        if (!island.joints.empty()) build_joints(work.joint_pool, island.joints, work.solver_bodies);
        IslandProbe* probe = begin_probe(world, work, island);
        settings.substeps = substeps;
        // The sweeps that fewer substeps leave out are made where they are cheap and take most of a penetration away.
        settings.first_solve = std::max(1, default_substeps / substeps);
        settings.may_gain = plan.pace != Pace::kFast;
        settings.contact_push = 1 - std::pow(1 - settings.contact_push, static_cast<Real>(default_substeps) / substeps);
        const SiReport si = solver == SolverChoice::kTgs
                                ? solve_island_tgs(work.solver_bodies, work.contact_pool, work.joint_pool, island, dt, settings, probe)
                                : solve_island_si(work.solver_bodies, work.contact_pool, work.joint_pool, island, dt, settings,
                                                  wide ? &work.wide_contacts : nullptr, probe);
        island_report.iterations = std::max(si.contact_sweeps, si.joint_sweeps);
        work.solved.add(si);
    }
    const Real kept = static_cast<Real>(substeps) / world.settings.substeps;
    if (wide) {  // the pool's own warm impulses are read no more
        work.wide_contacts.scale_results(kept);
        if (kept != 1) scale_warm_start(work.joint_pool, island.joints, kept);
    } else {
        scale_warm_impulses(work, island, kept);
    }
    if (solver != plan.solver) island_report.fell_back_from = plan.solver;
    island_report.solver = solver;
    island_report.substeps = substeps;
    return true;
}

// What has not been solved directly for long gives its memory back.
void forget_direct_states(WorldData& world) {
    constexpr std::uint64_t kKept = 256;
    if (++world.step_count % kKept != 0) return;
    std::erase_if(world.direct_states, [&](const auto& entry) { return entry.second.last_step + kKept < world.step_count; });
}

void refuse_island(const WorldData& world, int index, StepReport& report) {
    report.ok = false;
    ++report.islands_refused;
    report.refused_body = std::min(report.refused_body, world.islands.body_list()[world.islands.bodies(index).begin]);
}

void clear_rows(WorldData& world, IslandWorkspace& work) {
    work.solver_bodies.clear();
    work.solver_bodies.motion.emplace_back();  // kImmovable
    work.solver_bodies.velocity.emplace_back();
    work.contact_pool.clear();
    work.joint_pool.clear();
    work.block_sources.clear();
    for (auto& sources : work.joint_sources) sources.clear();
    work.solver_index.resize(world.bodies.size(), -1);
}

}  // namespace

int add_kinematic(WorldData& world, IslandWorkspace& work, std::uint32_t body, SiIsland& island) {
    const Body& b = world.bodies[body];
    BodyMotion motion;
    motion.x = b.X_WB.p;
    motion.q = b.X_WB.q;
    motion.R = b.R;
    work.solver_bodies.motion.push_back(motion);
    work.solver_bodies.velocity.push_back({b.v, b.w});
    work.solver_index[body] = work.solver_bodies.size() - 1;
    work.kinematic_used.push_back(body);
    island.body_end = work.solver_bodies.size();
    return work.solver_index[body];
}

void build_islands(WorldData& world, StepReport& report) {
    IslandBuilder& islands = world.islands;
    refresh_active(world);
    islands.begin(world.bodies.size(), world.active.bodies.numbers());
    const auto dynamic = [&](std::uint32_t body) { return body != UINT32_MAX && world.bodies[body].is_awake() ? body : UINT32_MAX; };
    const std::vector<Contact>& contacts = world.contacts.slots();
    const std::vector<std::uint32_t>& slots = world.active.contacts.numbers();
    for (std::size_t i = 0; i < slots.size(); ++i) {
        if (i + 2 * kPrefetchAhead < slots.size()) prefetch_contact(contacts[slots[i + 2 * kPrefetchAhead]], 1);
        const std::uint32_t k = slots[i];
        const Contact& c = contacts[k];
        if (c.manifold_count == 0) continue;
        const std::uint32_t a = dynamic(c.body_a), b = dynamic(c.body_b);
        if (a != UINT32_MAX || b != UINT32_MAX) islands.add(a, b, IslandBuilder::kContact, k);
    }
    for (const std::uint32_t k : world.active.joints.numbers()) {
        const Joint& j = world.joints[k];
        const std::uint32_t a = dynamic(j.body_a), b = dynamic(j.body_b);
        if (a != UINT32_MAX || b != UINT32_MAX) islands.add(a, b, IslandBuilder::kJoint, k);
    }
    islands.finish();
    report.islands = static_cast<std::uint32_t>(islands.count());
    world.clock.lap(Phase::kIslands);
}

namespace {

// Everything that an island reads but does not own stays as it is meanwhile; what it writes, its bodies, contacts and joints, is its own.
void step_island(WorldData& world, IslandWorkspace& work, int index, Real dt, Real scale, PhaseClock* clock) {
    if (scale == 1 && is_standing(world, index)) return report_standing(world, index, work.report);
    SiIsland island;
    IslandReport island_report;
    const auto attempt = [&](int level) {
        clear_rows(world, work);
        work.island_stands = false;
        island = build_island(world, work, index);
        if (clock != nullptr) clock->lap(Phase::kRows);
        island_report = {};
        const bool solved = solve_island(world, work, index, island, dt, scale, level, island_report);
        if (clock != nullptr) clock->lap(Phase::kSolve);
        return solved;
    };
    const bool is_solved = world.settings.tolerance > 0 ? solve_to_tolerance(world, work, index, dt, attempt) : attempt(kUncontrolled);
    if (world.settings.diagnostics) {
        island_report.is_refused = !is_solved;
        note_island(world, work, index, island, island_report);
        world.diagnostics.islands[index] = island_report;
    }
    work.report.normal_rows += static_cast<std::uint32_t>(work.contact_pool.point_count);
    work.report.friction_rows += static_cast<std::uint32_t>(work.contact_pool.friction_count);
    if (!is_solved) {
        refuse_island(world, index, work.report);
        return;
    }
    ++work.report.islands_of[static_cast<int>(island_report.solver)];
    store_island(world, work, index, island);
    if (clock != nullptr) clock->lap(Phase::kStore);
    work.report.joint_rows += static_cast<std::uint32_t>(island.joints.rows());
}

// Whether one worker would have more to do for it than the others have for all the rest: then all of them solve it together.
bool is_large(const WorldData& world, int index) {
    constexpr double kMoreThanFair = 1.2;
    const auto contacts = [&](int k) {
        const IndexRange r = world.islands.items(k, IslandBuilder::kContact);
        return r.end - r.begin;
    };
    const double all = static_cast<double>(world.islands.item_list(IslandBuilder::kContact).size());
    return world.team != nullptr && contacts(index) * world.team->size() > kMoreThanFair * all;
}

// Large ones after each other, the others side by side.
void step_all_islands(WorldData& world, Real dt, Real scale) {
    const int count = world.islands.count();
    IslandWorkspace& leader = world.workspaces.front();
    leader.team = world.team;
    for (int k = 0; k < count && world.team != nullptr; ++k)
        if (is_large(world, k)) step_island(world, leader, k, dt, scale, &world.clock);
    leader.team = nullptr;
    PhaseClock* const clock = world.team == nullptr ? &world.clock : nullptr;  // it has one hand
    for_pieces(world.team, static_cast<std::size_t>(count), 1, [&](std::size_t begin, std::size_t end, int worker) {
        for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k)
            if (!is_large(world, k)) step_island(world, world.workspaces[worker], k, dt, scale, clock);
    });
}

// Sums, and the largest residuals: the same whoever solved what.
void take_report(WorldData& world, IslandWorkspace& work, SiReport& solved, StepReport& report) {
    const StepReport& r = work.report;
    report.ok &= r.ok;
    for (int k = 0; k < kSolverChoices; ++k) report.islands_of[k] += r.islands_of[k];
    report.islands_refused += r.islands_refused;
    report.refused_body = std::min(report.refused_body, r.refused_body);
    report.normal_rows += r.normal_rows;
    report.friction_rows += r.friction_rows;
    report.joint_rows += r.joint_rows;
    report.factorisations += r.factorisations;
    take_error_report(r, report);
    solved.add(work.solved);
    world.broken.insert(world.broken.end(), work.broken.begin(), work.broken.end());
    work.report = {};
    work.solved = {};
    work.broken.clear();
}

}  // namespace

void solve_islands(WorldData& world, Real dt, StepReport& report) {
    if (world.settings.tolerance > 0) prepare_error_control(world);
    if (world.islands.count() == 0) return;
    forget_direct_states(world);
    if (world.settings.diagnostics) {
        world.diagnostics.islands.assign(world.islands.count(), {});
        world.diagnostics_start.work.assign(world.islands.count(), {});
    }
    // Impulses of a substep scale with its length. Those of a far shorter one are rounding noise, which would be made great.
    constexpr Real kMostGrowth = 1e3;
    const Real growth = world.last_dt > 0 ? dt / world.last_dt : 1, scale = growth > kMostGrowth ? 0 : growth;
    step_all_islands(world, dt, scale);
    world.clock.lap(Phase::kSolve);
    SiReport solved;
    for (IslandWorkspace& work : world.workspaces) take_report(world, work, solved, report);
    disable_broken(world, report);
    report.contact_sweeps = solved.contact_sweeps;
    report.joint_sweeps = solved.joint_sweeps;
    report.rotor_calls += solved.rotor_calls;
    report.residual = solved.residual;
    report.natural_residual = solved.natural_residual;
}

}  // namespace cairn
