// Random bodies, small hand-built islands, and the dense matrices that the solver's rows are measured against.
#pragma once

#include "solver/si.hpp"

#include <random>
#include <vector>

namespace cairn::solver_test {

using Random = std::mt19937;
using Vec12 = Eigen::Matrix<Real, 12, 1>;
using Mat12 = Eigen::Matrix<Real, 12, 12>;

constexpr Real kEpsilon = 2.220446049250313e-16;

inline Real uniform(Random& random, Real low, Real high) {
    return std::uniform_real_distribution<Real>(low, high)(random);
}

// In the cube of half edge `size`.
inline Vec3 random_vector(Random& random, Real size = 1) {
    const Real x = uniform(random, -size, size), y = uniform(random, -size, size), z = uniform(random, -size, size);
    return Vec3(x, y, z);
}

inline Vec3 random_direction(Random& random) {
    for (;;) {
        const Vec3 v = random_vector(random);
        if (v.norm() > 0.1 && v.norm() <= 1) return v.normalized();
    }
}

inline Quat random_rotation(Random& random, Real largest_angle = kPi) {
    const Vec3 axis = random_direction(random);
    return exp_rotation(uniform(random, 0, largest_angle) * axis);
}

// Principal moments of a solid box of the mass with edges between 0.6 m and 2 m: never closer than the edges are, at most 1 : 11 apart.
inline Vec3 random_moments(Random& random, Real mass) {
    const Real x = uniform(random, 0.6, 1.0), y = uniform(random, 1.1, 1.5), z = uniform(random, 1.6, 2.0);
    return mass / 12 * Vec3(y * y + z * z, x * x + z * z, x * x + y * y);
}

inline void set_pose(BodyMotion& m, const Vec3& x, const Quat& q) {
    m.x = x;
    m.q = q;
    m.R = q.toRotationMatrix();
    m.inv_inertia_W = m.R * m.inv_inertia_B * m.R.transpose();
}

inline BodyMotion make_body(Real mass, const RotorInertia& rotor, const Vec3& x, const Quat& q) {
    BodyMotion m;
    m.inv_mass = 1 / mass;
    m.rotor = rotor;
    const Mat3 P = rotor.R_BP.toRotationMatrix();
    m.inv_inertia_B = P * rotor.moments.cwiseInverse().asDiagonal() * P.transpose();
    m.moves = true;
    set_pose(m, x, q);
    return m;
}

// A body of random mass, tensor and pose.
inline BodyMotion random_body(Random& random) {
    const Real mass = uniform(random, 0.5, 5);
    const Vec3 moments = random_moments(random, mass);
    const RotorInertia rotor = make_rotor_inertia(moments, random_rotation(random));
    const Vec3 x = random_vector(random);
    return make_body(mass, rotor, x, random_rotation(random));
}

inline BodyMotion immovable_body(const Vec3& x, const Quat& q) {
    BodyMotion m;
    set_pose(m, x, q);
    return m;
}

// The inertia tensor in World, from the principal moments rather than from the inverses that the solver carries.
inline Mat3 inertia_W(const BodyMotion& m) {
    const Mat3 P = (m.q * m.rotor.R_BP).toRotationMatrix();
    return P * m.rotor.moments.asDiagonal() * P.transpose();
}

// M⁻¹ of two bodies, in the order (v_a, w_a, v_b, w_b).
inline Mat12 dense_inverse_mass(const BodyMotion& a, const BodyMotion& b) {
    Mat12 M = Mat12::Zero();
    const BodyMotion* body[2] = {&a, &b};
    for (int k = 0; k < 2; ++k) {
        if (!body[k]->moves) continue;
        M.block<3, 3>(6 * k, 6 * k) = body[k]->inv_mass * Mat3::Identity();
        M.block<3, 3>(6 * k + 3, 6 * k + 3) = inertia_W(*body[k]).inverse();
    }
    return M;
}

// A pose after moving along (v, w) for the time e: x + e v, exp(e w) R.
inline JointPose displaced(const JointPose& p, const Vec3& v, const Vec3& w, Real e) {
    return {p.x + e * v, exp_rotation(e * w).toRotationMatrix() * p.R};
}

// Bodies, contacts and joints of one island. Body 0 is the world.
struct Island {
    SolverBodies bodies;
    ContactPool contacts;
    JointPool joints;
    SiIsland range;

    Island() { add_body(immovable_body(Vec3::Zero(), Quat::Identity()), {}); }

    int add_body(const BodyMotion& motion, const BodyVelocity& velocity) {
        bodies.motion.push_back(motion);
        bodies.velocity.push_back(velocity);
        range.body_begin = 1;
        range.dynamic_end = range.body_end = bodies.size();
        return bodies.size() - 1;
    }

    // Adds a block and builds its rows. `n` points from b to a and turns with the body that `frame` names.
    void add_contact(int a, int b, const Vec3& n, NormalFrame frame, const std::vector<PointGeometry>& points, Real mu,
                     Real restitution = 0) {
        ContactBlock block;
        block.a = a;
        block.b = b;
        block.first = static_cast<int>(contacts.normals.size());
        block.count = static_cast<int>(points.size());
        block.n = block.n_local = n;
        if (frame == NormalFrame::kA) block.n_local = bodies.motion[a].R.transpose() * n;
        if (frame == NormalFrame::kB) block.n_local = bodies.motion[b].R.transpose() * n;
        block.frame = frame;
        block.inv_mass_a = bodies.motion[a].inv_mass;
        block.inv_mass_b = bodies.motion[b].inv_mass;
        block.mu = mu;
        block.restitution = restitution;
        block.inv_mass_sum = block.inv_mass_a + block.inv_mass_b;
        block.share_a = block.inv_mass_a / block.inv_mass_sum;
        block.share_b = block.inv_mass_b / block.inv_mass_sum;
        if (mu > 0) {
            block.friction = static_cast<int>(contacts.frictions.size());
            contacts.frictions.resize(contacts.frictions.size() + 2 * points.size());
        }
        const std::size_t count = contacts.normals.size() + points.size();
        contacts.normals.resize(count);
        contacts.warm.resize(count);
        contacts.impulse.resize(count);
        contacts.total.resize(count);
        contacts.geometry.insert(contacts.geometry.end(), points.begin(), points.end());
        renew(block);
        contacts.blocks.push_back(block);
        range.contacts.end = static_cast<int>(contacts.blocks.size());
        range.has_bounce = range.has_bounce || restitution > 0;
    }

    // What a step starts with: rows at the present poses.
    void renew_contacts() {
        for (ContactBlock& block : contacts.blocks) renew(block);
    }
    void renew(ContactBlock& block) {
        build_block(contacts, block, bodies);
        for (int i = 0; i < block.count && block.friction >= 0; ++i)
            contacts.geometry[block.first + i].t1 = contacts.frictions[block.friction + 2 * i].t;
    }

    SiReport step(Real dt, const SiSettings& settings, WideContacts* wide = nullptr, IslandProbe* probe = nullptr) {
        for (PointImpulse& total : contacts.total) total = {};
        return solve_island_si(bodies, contacts, joints, range, dt, settings, wide, probe);
    }

    // The points as a manifold cache has them, for steps from states to states.
    std::vector<PointState> states;

    // From the pool's geometry, tangents and warm impulses.
    void make_states() {
        states.assign(contacts.geometry.size(), {});
        for (const ContactBlock& block : contacts.blocks)
            for (int p = block.first; p < block.first + block.count; ++p) {
                const PointGeometry& g = contacts.geometry[p];
                const WarmImpulse& warm = contacts.warm[p];
                PointState& s = states[p];
                s.core_a_A = g.core_a_A;
                s.core_b_B = g.core_b_B;
                s.radius_a = g.radius_a;
                s.radius_b = g.radius_b;
                s.warm_position = warm.position;
                s.warm_velocity = warm.velocity;
                if (block.friction < 0) continue;
                const Vec3 t2 = block.n.cross(g.t1);
                s.t1 = g.t1;
                s.warm_friction = warm.friction[0] * g.t1 + warm.friction[1] * t2;
                s.warm_friction_first = warm.friction_first[0] * g.t1 + warm.friction_first[1] * t2;
            }
    }

    // With `wide`, which has planned its contacts, or without.
    SiReport step_states(Real dt, const SiSettings& settings, WideContacts* wide, Real warm_scale = 1, IslandProbe* probe = nullptr) {
        for (ContactBlock& block : contacts.blocks) {
            block.states = &states[block.first];
            orient_normal(block, bodies);
        }
        const PointLoad load{dt, settings.model.friction, warm_scale};
        if (wide) {
            wide->pack(contacts, bodies, range.body_begin, range.body_end, load);
        } else {
            load_points(contacts, range.contacts, bodies, load);
            build_contacts(contacts, range.contacts, bodies);
        }
        const SiReport report = solve_island_si(bodies, contacts, joints, range, dt, settings, wide, probe);
        if (wide)
            wide->store();
        else
            store_points(contacts, range.contacts);
        return report;
    }
};

// Sum of m v over the dynamic bodies.
inline Vec3 linear_momentum(const SolverBodies& bodies) {
    Vec3 p = Vec3::Zero();
    for (int i = 0; i < bodies.size(); ++i)
        if (bodies.motion[i].moves) p += bodies.velocity[i].v / bodies.motion[i].inv_mass;
    return p;
}

// Sum of x × m v + I w over the dynamic bodies, about the origin.
inline Vec3 angular_momentum(const SolverBodies& bodies) {
    Vec3 L = Vec3::Zero();
    for (int i = 0; i < bodies.size(); ++i) {
        const BodyMotion& m = bodies.motion[i];
        if (m.moves) L += m.x.cross(bodies.velocity[i].v) / m.inv_mass + inertia_W(m) * bodies.velocity[i].w;
    }
    return L;
}

// The pool of a joint kind.
template <JointKind K>
std::vector<JointBlock<joint_rows(K)>>& pool_of(JointPool& pool) {
    if constexpr (K == JointKind::kBall) return pool.ball;
    if constexpr (K == JointKind::kHinge) return pool.hinge;
    if constexpr (K == JointKind::kSlider) return pool.slider;
    if constexpr (K == JointKind::kFixed) return pool.fixed;
    if constexpr (K == JointKind::kDistance) return pool.distance;
}

// Adds a joint without warm impulses and builds its rows.
template <JointKind K>
void add_joint(Island& island, int a, int b, const JointGeometry& geometry) {
    JointBlock<joint_rows(K)>& joint = pool_of<K>(island.joints).emplace_back();
    joint.a = a;
    joint.b = b;
    joint.geometry = geometry;
    joint.warm_first.setZero();
    joint.warm_second.setZero();
    joint.held_impulse.setZero();
    joint.impulse.setZero();
    joint.total.setZero();
    island.range.joints.end[static_cast<int>(K)] = static_cast<int>(pool_of<K>(island.joints).size());
    build_joints(island.joints, island.range.joints, island.bodies);
}

// A joint between the two poses: anchor on A and frames at random, what belongs to B such that the anchors are `offset` apart (A's minus
// B's) and the frames turned by `twist`, both in World.
inline JointGeometry joint_between(Random& random, const JointPose& a, const JointPose& b, const Vec3& offset, const Quat& twist) {
    JointGeometry g;
    g.anchor_a_A = random_vector(random);
    g.frame_A = random_rotation(random).toRotationMatrix();
    g.anchor_b_B = b.R.transpose() * (a.x + a.R * g.anchor_a_A - offset - b.x);
    g.frame_B = b.R.transpose() * twist.toRotationMatrix() * a.R * g.frame_A;
    g.length = offset.norm();
    return g;
}

}  // namespace cairn::solver_test
