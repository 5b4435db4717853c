// The step: the pipeline only, a stage a line. The stages are in update_pairs.cpp, contact_update.cpp, solve_islands.cpp, integrate.cpp and
// sleep.cpp.
#include "engine/step_team.hpp"
#include "engine/world_data.hpp"
#include "engine/world_impl.hpp"

#include <cmath>

namespace cairn {

namespace {

void run_stages(WorldData& world, Real dt, StepReport& report) {
    const bool diagnoses = world.settings.diagnostics;
    if (diagnoses) begin_diagnostics(world);
    refresh_active(world);
    drive_kinematic_bodies(world, dt);
    update_pairs(world, dt, report);
    update_contacts(world, dt, report);
    wake_touched(world);
    build_islands(world, report);
    solve_islands(world, dt, report);
    move_free_bodies(world, dt, report);
    move_kinematic_bodies(world, dt, report);
    if (diagnoses) note_awake(world);
    put_to_sleep(world, dt, report);
    if (diagnoses) finish_diagnostics(world, report);
}

// [s], about, of a step on one thread: a contact that was looked at (what stands is not) with its part of the solve, a row of a joint, a
// body in flight.
double estimate_time(const WorldData& world, const StepReport& report) {
    return 1e-6 * world.contacts_updated + 1e-6 * report.joint_rows + 5e-8 * report.free_bodies;
}

// Whether the step is worth the start of workers. It will be about as long as the last one; of the first, the bodies tell.
bool wants_team(const WorldData& world) {
    constexpr double kFewTimes = 4, kBodyTime = 1e-6;  // [s]
    if (world.tasks == nullptr || world.tasks->workers() <= 1) return false;
    const bool is_first = world.last_dt == 0;
    const double work = is_first ? kBodyTime * static_cast<double>(world.bodies.size()) : world.last_work;
    return work >= kFewTimes * world.tasks->start_time();
}

}  // namespace

StepReport World::step(Real dt) noexcept {
    StepReport report;
    WorldData& world = impl_->data;
    if (!(std::isfinite(dt) && dt >= world.settings.substeps * kLeastSubstep)) {
        report.ok = false;
        return report;
    }
    world.clock.start(world.settings.profile);
    if (wants_team(world)) {
        with_team(*world.tasks, [&](Team& team) {
            world.team = &team;
            run_stages(world, dt, report);
            world.team = nullptr;
        });
    } else {
        run_stages(world, dt, report);
    }
    world.last_work = estimate_time(world, report);
    if (world.clock.on()) report.profile = &world.clock.profile();
    world.time += dt;
    world.last_dt = dt;
    return report;
}

}  // namespace cairn
