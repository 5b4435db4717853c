#include "solver/rattle_rate.hpp"

#include <algorithm>

namespace cairn {

Vec3 common_velocity(const SolverBodies& bodies, const SiIsland& island, const JointRowList& rows) {
    for (const JointRow& row : rows.list())
        if (!row.moves[0] || !row.moves[1]) return Vec3::Zero();
    return bodies.velocity[island.body_begin].v;
}

JointMotion joint_motion(const SolverBodies& bodies, const JointPool& joints, const SiIsland& island, const JointRowList& rows,
                         const Real* forces, Real size, std::vector<Real>& stiffness) {
    const int first = island.body_begin;
    std::fill(stiffness.begin(), stiffness.end(), 0.0);
    for_each_listed_joint(joints, island.joints, [&](auto kind, const auto& j, int index) {
        constexpr JointKind K = decltype(kind)::value;
        const JointRow& row = rows.list()[index];
        const Vec3 anchors[2] = {j.geometry.anchor_a_A, j.geometry.anchor_b_B};
        const BodyMotion &a = bodies.motion[j.a], &b = bodies.motion[j.b];
        const Real f = joint_force<K>(j.geometry, {a.x, a.R}, {b.x, b.R}, Eigen::Map<const VecN<joint_rows(K)>>(forces + row.first)).norm();
        for (int side = 0; side < 2; ++side) {
            if (!row.moves[side]) continue;
            const BodyMotion& m = bodies.motion[row.body[side]];
            const Vec3 arm = m.R * anchors[side];
            const Real r2 = arm.squaredNorm();
            Real& k = stiffness[row.body[side] - first];
            if (r2 > 0) k += f * (m.inv_inertia_W.trace() * r2 - arm.dot(m.inv_inertia_W * arm)) / (2 * std::sqrt(r2));
            if constexpr (K == JointKind::kDistance) k += f * m.inv_mass / j.geometry.length;
        }
    });
    const Vec3 common = common_velocity(bodies, island, rows);  // flying all together takes nothing to resolve
    Real tension2 = 0, spin2 = 0, rate2 = 0, speed = 0;
    for (int i = first; i < island.dynamic_end; ++i) {
        const Real t = 0.25 * stiffness[i - first], w = bodies.velocity[i].w.squaredNorm();
        tension2 = std::max(tension2, t);
        spin2 = std::max(spin2, w);
        rate2 = std::max(rate2, t + w);
        speed = std::max(speed, (bodies.velocity[i].v - common).norm() + size * std::sqrt(w));
    }
    return {std::sqrt(tension2), std::sqrt(spin2), std::sqrt(rate2), speed};
}

JointEnergy joint_energy(const SolverBodies& bodies, const SiIsland& island) {
    JointEnergy e;
    e.is_kept = island.body_end == island.dynamic_end;
    for (int i = island.body_begin; i < island.dynamic_end; ++i) {
        const BodyMotion& m = bodies.motion[i];
        const BodyVelocity& u = bodies.velocity[i];
        const Vec3 w_B = m.R.transpose() * u.w;
        const Vec3 w_P = m.rotor.is_aligned ? w_B : Vec3(m.rotor.R_BP.conjugate() * w_B);
        const Real mass = 1 / m.inv_mass;
        const Real kinetic = 0.5 * (mass * u.v.squaredNorm() + w_P.dot(m.rotor.moments.cwiseProduct(w_P)));
        e.kinetic += kinetic;
        e.total += kinetic - mass * m.acceleration.dot(m.x);
        e.weight += mass * m.acceleration.norm();
        e.is_kept &= m.torque.isZero(0);
    }
    return e;
}

RattleCut choose_cut(const JointMotion& motion, Real dt, Real size, const RattleSettings& settings) {
    const auto substeps_for = [&](Real turn, Real most) {
        const Real n = std::ceil(turn / most);
        return n < settings.max_substeps ? std::max(static_cast<int>(n), 1) : settings.max_substeps;  // also for what is not a number
    };
    const Real turn = motion.rate * dt;
    // One stage misses (Ω dt)²/24 of the speed, which is on its way for some 1/Ω. That is nothing where nothing moves.
    const bool still = turn * dt * motion.speed < 1e-3 * settings.tolerance * size;
    if (settings.substeps > 0) return {settings.substeps, settings.order < 4 || still ? 1 : 5};
    // A whip is fast by its tension and its spin alike; a taut chain by its tension alone.
    const bool stiff = turn > settings.turn_per_substep && motion.tension > 5 * motion.spin;
    if (settings.level >= 0) {
        if (stiff) return {substeps_for(turn, settings.turn_per_stage) << settings.level, 1};
        return settings.level == 0 ? RattleCut{1, 1} : RattleCut{1 << (settings.level - 1), 5};
    }
    if (settings.order < 4 || stiff) return {substeps_for(turn, settings.turn_per_stage), 1};
    return {substeps_for(turn, settings.turn_per_substep), still ? 1 : 5};
}

}  // namespace cairn
