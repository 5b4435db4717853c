// The step: the pipeline only, a stage a line. The stages are in update_pairs.cpp, contact_update.cpp, solve_islands.cpp, integrate.cpp and
// sleep.cpp.
#include "engine/world_data.hpp"
#include "engine/world_impl.hpp"

#include <cmath>

namespace cairn {

StepReport World::step(Real dt) noexcept {
    StepReport report;
    WorldData& world = impl_->data;
    if (!(std::isfinite(dt) && dt >= world.settings.substeps * kLeastSubstep)) {
        report.ok = false;
        return report;
    }
    world.clock.start(world.settings.profile);
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
    if (world.clock.on()) report.profile = &world.clock.profile();
    world.time += dt;
    world.last_dt = dt;
    return report;
}

}  // namespace cairn
