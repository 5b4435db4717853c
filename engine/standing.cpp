// Islands that stand. Where a step leaves all poses and impulses of an island as they were and all velocities zero, the next step has the
// same to do and would come to the same: its answer is there already. So it is asked whether anything of the island is another, and if
// not, nothing is done. Other than sleep this is exact, waits for no time, and nothing has to be woken.
//
// A body stands from the end of such a step on until a caller touches it (wake_group), one of its contacts goes or is brought up to date,
// because the other body moves (update_contact, end_contact), or its island is solved again. So where all bodies of an island stand, no
// contact of them is missing; and what has come is not held.
#include "engine/world_data.hpp"

namespace cairn {

bool is_standing(const WorldData& world, int index) {
    const IslandBuilder& islands = world.islands;
    const IndexRange joints = islands.items(index, IslandBuilder::kJoint);
    if (joints.begin < joints.end) return false;
    const IndexRange bodies = islands.bodies(index), contacts = islands.items(index, IslandBuilder::kContact);
    for (int k = bodies.begin; k < bodies.end; ++k)
        if (!world.bodies[islands.body_list()[k]].stands) return false;
    for (int k = contacts.begin; k < contacts.end; ++k)
        if (!world.contacts.slots()[islands.item_list(IslandBuilder::kContact)[k]].held) return false;
    return true;
}

void report_standing(WorldData& world, int index, StepReport& report) {
    const IslandBuilder& islands = world.islands;
    const IndexRange contacts = islands.items(index, IslandBuilder::kContact);
    std::uint32_t normal_rows = 0, friction_rows = 0;
    for (int k = contacts.begin; k < contacts.end; ++k) {
        const Contact& c = world.contacts.slots()[islands.item_list(IslandBuilder::kContact)[k]];
        normal_rows += static_cast<std::uint32_t>(c.point_count);
        if (c.mu > 0) friction_rows += 2 * static_cast<std::uint32_t>(c.point_count);
    }
    report.normal_rows += normal_rows;
    report.friction_rows += friction_rows;
    ++report.islands_of[static_cast<int>(SolverChoice::kDirect)];
    if (!world.settings.diagnostics) return;
    const IndexRange bodies = islands.bodies(index);
    const std::uint32_t first = islands.body_list()[bodies.begin];
    IslandReport& island = world.diagnostics.islands[index];
    island.first_body = {first, world.info[first].generation};
    island.bodies = static_cast<std::uint32_t>(bodies.end - bodies.begin);
    island.contacts = normal_rows;
    island.rows = normal_rows + friction_rows;
    island.solver = SolverChoice::kDirect;
    island.reason = SolverReason::kStands;
    island.substeps = 1;
    island.residual.rows = island.rows;  // all velocities are zero, and with them the residuals
}

void note_standing(WorldData& world, int index) {
    const IslandBuilder& islands = world.islands;
    const IndexRange bodies = islands.bodies(index), contacts = islands.items(index, IslandBuilder::kContact);
    for (int k = bodies.begin; k < bodies.end; ++k) {
        Body& body = world.bodies[islands.body_list()[k]];
        body.v.setZero();
        body.w.setZero();
        body.stands = true;
    }
    for (int k = contacts.begin; k < contacts.end; ++k) world.contacts.slots()[islands.item_list(IslandBuilder::kContact)[k]].held = true;
}

}  // namespace cairn
