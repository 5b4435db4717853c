#include "engine/step_diagnostics.hpp"

#include "engine/world_data.hpp"

#include <cmath>

namespace cairn {
namespace {

BodyId body_id(const WorldData& world, std::uint32_t body) {
    return body == UINT32_MAX ? BodyId{} : BodyId{body, world.info[body].generation};
}

// Where the row of a measure came from.
void name_row(const WorldData& world, const IslandWorkspace& work, const ResidualMeasure& measure, StepResidual& out) {
    out.worst = measure.kind;
    if (measure.kind == RowKind::kNone) return;
    if (measure.kind == RowKind::kJoint) {
        const std::uint32_t k = work.joint_sources[measure.joint_kind][measure.index];
        const Joint& joint = world.joints[k];
        out.joint = {k, joint.generation};
        out.body_a = body_id(world, joint.body_a);
        out.body_b = body_id(world, joint.body_b);
        return;
    }
    const Contact& contact = world.contacts.slots()[work.block_sources[measure.index].contact];
    out.body_a = body_id(world, contact.body_a);
    out.body_b = body_id(world, contact.body_b);
}

// rms² · rows of both is added.
void add(StepResidual& sum, const StepResidual& r) {
    const Real squares = sum.rms * sum.rms * static_cast<Real>(sum.rows) + r.rms * r.rms * static_cast<Real>(r.rows);
    const std::uint64_t rows = sum.rows + r.rows;
    if (r.max > sum.max) sum = r;
    sum.rows = rows;
    sum.rms = rows > 0 ? std::sqrt(squares / static_cast<Real>(rows)) : 0;
}

bool counts(const Body& body) {
    return body.alive && body.type == BodyType::kDynamic;
}

// Rotation vector of `to` after `from`, of angle at most π.
Vec3 turn_between(const Quat& from, const Quat& to) {
    const Quat q = to * from.conjugate();
    const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
    const Real s = v.norm();
    return s < 1e-12 ? Vec3(2 * v) : Vec3(2 * std::atan2(s, std::abs(q.w())) / s * v);
}

void find_joint_errors(const WorldData& world, StepDiagnostics& d) {
    for (std::uint32_t k = 0; k < world.joints.size(); ++k) {
        if (!world.joints[k].alive) continue;
        const World::JointError e = measure_joint(world, world.joints[k]);
        const JointId id{k, world.joints[k].generation};
        if (e.position > d.joint_error) {
            d.joint_error = e.position;
            d.joint_error_at = id;
        }
        if (e.angle > d.joint_angle) {
            d.joint_angle = e.angle;
            d.joint_angle_at = id;
        }
    }
}

void find_penetration(const WorldData& world, StepDiagnostics& d) {
    for (const std::uint32_t k : world.active.contacts.numbers()) {
        const Contact& c = world.contacts.slots()[k];
        if (c.manifold_count == 0 || !(c.deepest > d.penetration)) continue;
        d.penetration = c.deepest;
        d.penetration_a = body_id(world, c.body_a);
        d.penetration_b = body_id(world, c.body_b);
    }
}

// Work of gravity and of the bodies' own forces, from where the bodies went.
void add_work_of_forces(const WorldData& world, StepEnergy& energy) {
    for (std::size_t i = 0; i < world.diagnostics_start.poses.size(); ++i) {
        const Body& body = world.bodies[i];
        if (!counts(body)) continue;
        const Pose& start = world.diagnostics_start.poses[i];
        const Vec3 way = body.X_WB.p - start.p;
        energy.gravity += world.info[i].mass * world.settings.gravity.dot(way);
        if (body.has_load) energy.applied += body.force.dot(way) + body.torque.dot(turn_between(start.q, body.X_WB.q));
    }
    energy.potential_change = -energy.gravity;
}

}  // namespace

const char* to_string(RowKind kind) {
    constexpr const char* names[] = {"none", "normal", "friction", "joint"};
    return names[static_cast<int>(kind)];
}

const char* to_string(SolverReason reason) {
    constexpr const char* names[kSolverReasons] = {"it was asked for",
                                                   "only it has the model that was asked for",
                                                   "nothing but joints holds the bodies",
                                                   "the bodies touch, without joints or bounces",
                                                   "joints hold bodies that touch",
                                                   "bodies bounce",
                                                   "contacts have torsional or rolling friction",
                                                   "too many bodies move for a direct solve, or bodies of like masses",
                                                   "a single body moves",
                                                   "the direct solver did not converge lately",
                                                   "the direct solver has spent what the island may cost",
                                                   "nothing of it has changed since a direct solve"};
    return names[static_cast<int>(reason)];
}

Real kinetic_energy(const WorldData& world) {
    Real energy = 0;
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
        const Body& b = world.bodies[i];
        if (!counts(b)) continue;
        const Vec3 w_B = b.R.transpose() * b.w;
        energy += 0.5 * world.info[i].mass * b.v.squaredNorm() + 0.5 * w_B.dot(world.info[i].inertia_B * w_B);
    }
    return energy;
}

void begin_diagnostics(WorldData& world) {
    StepDiagnostics& d = world.diagnostics;
    std::vector<IslandReport> islands = std::move(d.islands);
    islands.clear();
    d = {};
    d.islands = std::move(islands);
    world.diagnostics_start.poses.resize(world.bodies.size());
    for (std::size_t i = 0; i < world.bodies.size(); ++i) world.diagnostics_start.poses[i] = world.bodies[i].X_WB;
    world.diagnostics_start.kinetic = kinetic_energy(world);
}

void note_island(WorldData& world, const IslandWorkspace& work, int index, const SiIsland& island, IslandReport& report) {
    const IndexRange bodies = world.islands.bodies(index);
    report.first_body = body_id(world, world.islands.body_list()[bodies.begin]);
    report.bodies = static_cast<std::uint32_t>(bodies.end - bodies.begin);
    report.joints = static_cast<std::uint32_t>(island.joints.count());
    report.contacts = static_cast<std::uint32_t>(work.contact_pool.point_count);
    report.rows = static_cast<std::uint32_t>(work.contact_pool.point_count + work.contact_pool.friction_count) +
                  static_cast<std::uint32_t>(island.joints.rows());
    if (report.is_refused) return;
    const ResidualMeasure& measure = work.probe.residual();
    report.residual.max = measure.max;
    report.residual.rows = measure.rows;
    report.residual.rms = measure.rows > 0 ? std::sqrt(measure.sum_of_squares / static_cast<Real>(measure.rows)) : 0;
    name_row(world, work, measure, report.residual);
    world.diagnostics_start.work[index] = work.probe.work();
}

void note_awake(WorldData& world) {
    world.diagnostics_start.awake = kinetic_energy(world);
}

void finish_diagnostics(WorldData& world, StepReport& report) {
    StepDiagnostics& d = world.diagnostics;
    for (const IslandReport& island : d.islands) add(d.residual, island.residual);
    find_joint_errors(world, d);
    find_penetration(world, d);
    StepEnergy& e = d.energy;
    add_work_of_forces(world, e);
    for (std::size_t i = 0; i < d.islands.size(); ++i) {
        const ImpulseWork& work = world.diagnostics_start.work[i];
        e.driven += work.driven;
        e.impacts += work.impacts;
        e.friction += work.friction;
        e.joints += work.joints;
        e.stabilisation += work.stabilisation;
    }
    const Real kinetic = kinetic_energy(world);
    e.sleep = kinetic - world.diagnostics_start.awake;
    e.kinetic_change = kinetic - world.diagnostics_start.kinetic;
    e.remainder = e.kinetic_change - (e.gravity + e.applied + e.driven + e.impacts + e.friction + e.joints + e.stabilisation + e.sleep);
    report.diagnostics = &d;
}

}  // namespace cairn
