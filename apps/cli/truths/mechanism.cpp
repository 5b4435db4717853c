#include "apps/cli/truths/mechanism.hpp"

#include "apps/cli/truth_parts.hpp"
#include "apps/cli/truths/extrapolation.hpp"
#include "engine/base/error.hpp"
#include "engine/base/hash.hpp"

#include <Eigen/Dense>

#include <map>

namespace cairn::cli {

namespace {

constexpr Real kTolerance = 1e-13;
constexpr int kState = 13;  // p, q (w, x, y, z), v, ω

// A joint's side: the body's place in the state, or −1 and a pose that stays; anchor and axes in the body's frame.
struct Side {
    int body = -1;
    Pose X;
    Vec3 anchor = Vec3::Zero();
    Vec3 axes[3];
};

struct SideNow {
    Vec3 p, r, v, w, axes[3];
};

// One scalar equation Σ J a + bias = 0 on the accelerations (linear, angular) of both sides.
struct Row {
    Vec3 linear[2] = {Vec3::Zero(), Vec3::Zero()};
    Vec3 angular[2] = {Vec3::Zero(), Vec3::Zero()};
    Real bias = 0;
};

struct MechanismJoint {
    JointType type = JointType::kBall;
    Side sides[2];
};

struct Mechanism {
    Vec3 gravity;
    std::vector<std::size_t> bodies;  // of the scene
    std::vector<Real> mass;
    std::vector<Mat3> inertia;  // body frame
    std::vector<MechanismJoint> joints;
};

Mechanism mechanism_of(const Scene& scene) {
    Mechanism m;
    m.gravity = scene.gravity;
    m.bodies = dynamic_bodies(scene);
    std::map<std::size_t, int> place;
    for (const std::size_t i : m.bodies) {
        place[i] = static_cast<int>(m.mass.size());
        m.mass.push_back(scene.bodies[i].mass);
        m.inertia.push_back(body_inertia(scene.bodies[i]));
    }
    for (const SceneJoint& joint : scene.joints) {
        MechanismJoint& made = m.joints.emplace_back();
        made.type = joint.def.type;
        const Vec3 n = joint.def.axis.normalized(), t = any_perpendicular(n);
        for (int s = 0; s < 2; ++s) {
            Side& side = made.sides[s];
            const std::optional<std::size_t>& body = s == 0 ? joint.body_a : joint.body_b;
            if (body) side.X = {scene.bodies[*body].rotation.normalized(), scene.bodies[*body].position};
            if (body && place.count(*body) != 0) side.body = place.at(*body);
            const Vec3& anchor = joint.def.type == JointType::kDistance && s == 1 ? joint.def.anchor_b : joint.def.anchor_a;
            const Quat back = side.X.q.conjugate();
            side.anchor = back * (anchor - side.X.p);
            side.axes[0] = back * n;
            side.axes[1] = back * t;
            side.axes[2] = back * n.cross(t);
        }
    }
    return m;
}

SideNow side_now(const Side& side, const std::vector<Real>& y) {
    SideNow now;
    Quat q = side.X.q;
    now.p = side.X.p;
    now.v = now.w = Vec3::Zero();
    if (side.body >= 0) {
        const Real* s = y.data() + kState * side.body;
        now.p = {s[0], s[1], s[2]};
        q = Quat(s[3], s[4], s[5], s[6]).normalized();
        now.v = {s[7], s[8], s[9]};
        now.w = {s[10], s[11], s[12]};
    }
    now.r = q * side.anchor;
    for (int k = 0; k < 3; ++k) now.axes[k] = q * side.axes[k];
    return now;
}

// All rows of a joint. d = x₁ − x₀ is the way from one anchor to the other, c its part of the acceleration that speeds alone make.
void add_rows(const MechanismJoint& joint, const SideNow& a, const SideNow& b, std::vector<Row>& rows) {
    const Vec3 d = b.p + b.r - a.p - a.r;
    const Vec3 speed = b.v + b.w.cross(b.r) - a.v - a.w.cross(a.r);
    const Vec3 c = b.w.cross(b.w.cross(b.r)) - a.w.cross(a.w.cross(a.r));
    const auto along = [&](const Vec3& u, const Vec3& extra_turn, Real extra) {
        Row row;
        row.linear[0] = -u;
        row.angular[0] = extra_turn - a.r.cross(u);
        row.linear[1] = u;
        row.angular[1] = b.r.cross(u);
        row.bias = u.dot(c) + extra;
        rows.push_back(row);
    };
    // x, fixed in the first body, keeps its angle with y, fixed in the second: (ω₀ − ω₁)·(x × y) = 0 and its derivative.
    const auto square = [&](const Vec3& x, const Vec3& y) {
        Row row;
        row.angular[0] = x.cross(y);
        row.angular[1] = -row.angular[0];
        row.bias = (a.w - b.w).dot(Vec3(a.w.cross(x).cross(y) + x.cross(b.w.cross(y))));
        rows.push_back(row);
    };
    const Vec3 zero = Vec3::Zero();
    switch (joint.type) {
        case JointType::kDistance:
            along(d, zero, speed.squaredNorm());
            return;
        case JointType::kSlider:
            for (int k = 1; k < 3; ++k) {  // d stays across the axes t of the first body
                const Vec3& t = a.axes[k];
                const Vec3 turn = a.w.cross(t);
                along(t, t.cross(d), a.w.cross(turn).dot(d) + 2 * turn.dot(speed));
            }
            break;
        default:
            for (int k = 0; k < 3; ++k) along(Vec3::Unit(k), zero, 0);
    }
    if (joint.type == JointType::kBall) return;
    square(a.axes[0], b.axes[1]);
    square(a.axes[0], b.axes[2]);
    if (joint.type != JointType::kHinge) square(a.axes[1], b.axes[2]);
}

using Vec6 = Eigen::Matrix<Real, 6, 1>;

// λ of A λ = b. A is symmetric and, unless joints say a thing twice, positive definite: tried first.
Eigen::VectorXd solve_rows(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
    const Eigen::LDLT<Eigen::MatrixXd> factors(A);
    if (factors.info() == Eigen::Success && factors.vectorD().minCoeff() > 1e-10 * factors.vectorD().maxCoeff()) return factors.solve(b);
    return A.completeOrthogonalDecomposition().solve(b);
}

// Adds M⁻¹ Jᵀ λ to the accelerations, so that J a + bias = 0. Each row speaks of two bodies at most: A = J M⁻¹ Jᵀ is put together body by
// body.
void add_joint_accelerations(const Mechanism& m, const std::vector<Row>& rows, const std::vector<const MechanismJoint*>& owner,
                             const std::vector<Mat3>& inverse, Eigen::VectorXd& acceleration) {
    struct Part {
        Eigen::Index row = 0;
        Vec6 J, JW;
    };
    std::vector<std::vector<Part>> parts(m.mass.size());  // of each body
    const Eigen::Index count = static_cast<Eigen::Index>(rows.size());
    Eigen::VectorXd b(count);
    for (Eigen::Index r = 0; r < count; ++r) {
        const Row& row = rows[static_cast<std::size_t>(r)];
        b[r] = -row.bias;
        for (int s = 0; s < 2; ++s) {
            const int body = owner[static_cast<std::size_t>(r)]->sides[s].body;
            if (body < 0) continue;
            const std::size_t k = static_cast<std::size_t>(body);
            Part part{r, Vec6::Zero(), Vec6::Zero()};
            part.J << row.linear[s], row.angular[s];
            part.JW << row.linear[s] / m.mass[k], inverse[k] * row.angular[s];
            b[r] -= part.J.dot(acceleration.segment<6>(6 * body));
            parts[k].push_back(part);
        }
    }
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(count, count);
    for (const std::vector<Part>& of_body : parts) {
        for (const Part& x : of_body) {
            for (const Part& y : of_body) A(x.row, y.row) += x.J.dot(y.JW);
        }
    }
    const Eigen::VectorXd lambda = solve_rows(A, b);
    for (std::size_t k = 0; k < parts.size(); ++k) {
        for (const Part& part : parts[k]) acceleration.segment<6>(6 * static_cast<Eigen::Index>(k)) += lambda[part.row] * part.JW;
    }
}

// Accelerations of all bodies: M a = f + Jᵀ λ with J a + bias = 0.
void derivative(const Mechanism& m, const std::vector<Real>& y, std::vector<Real>& dy) {
    const Eigen::Index n = static_cast<Eigen::Index>(m.mass.size());
    Eigen::VectorXd acceleration(6 * n);
    std::vector<Mat3> inverse(m.mass.size());
    for (Eigen::Index i = 0; i < n; ++i) {
        const Real* s = y.data() + kState * i;
        const std::size_t k = static_cast<std::size_t>(i);
        const Quat q(s[3], s[4], s[5], s[6]);
        const Mat3 R = q.normalized().toRotationMatrix();
        const Mat3 I = R * m.inertia[k] * R.transpose();
        const Vec3 w(s[10], s[11], s[12]), Iw = I * w;
        inverse[k] = I.inverse();
        acceleration.segment<3>(6 * i) = m.gravity;
        acceleration.segment<3>(6 * i + 3) = -(inverse[k] * w.cross(Iw));
    }
    std::vector<Row> rows;
    std::vector<const MechanismJoint*> owner;
    for (const MechanismJoint& joint : m.joints) {
        add_rows(joint, side_now(joint.sides[0], y), side_now(joint.sides[1], y), rows);
        owner.resize(rows.size(), &joint);
    }
    if (!rows.empty()) add_joint_accelerations(m, rows, owner, inverse, acceleration);
    dy.resize(y.size());
    for (Eigen::Index i = 0; i < n; ++i) {
        const Real* s = y.data() + kState * i;
        Real* out = dy.data() + kState * i;
        const Quat turn = Quat(0, s[10], s[11], s[12]) * Quat(s[3], s[4], s[5], s[6]);
        for (int k = 0; k < 3; ++k) out[k] = s[7 + k];
        out[3] = turn.w() / 2;
        for (int k = 0; k < 3; ++k) out[4 + k] = turn.vec()[k] / 2;
        for (int k = 0; k < 6; ++k) out[7 + k] = acceleration[6 * i + k];
    }
}

std::vector<std::vector<BodyState>> integrate_mechanism(const Scene& scene, const std::vector<Real>& times) {
    const Mechanism m = mechanism_of(scene);
    std::vector<BodyState> states;
    for (const BodyDef& b : scene.bodies) states.push_back({b.position, b.rotation.normalized(), b.linear_velocity, b.angular_velocity});
    std::vector<Real> y;
    for (const std::size_t i : m.bodies) {
        const BodyState& s = states[i];
        y.insert(y.end(), s.position.data(), s.position.data() + 3);
        y.insert(y.end(), {s.rotation.w(), s.rotation.x(), s.rotation.y(), s.rotation.z()});
        y.insert(y.end(), s.linear_velocity.data(), s.linear_velocity.data() + 3);
        y.insert(y.end(), s.angular_velocity.data(), s.angular_velocity.data() + 3);
    }
    std::vector<std::vector<BodyState>> out;
    Real now = 0;
    for (const Real t : times) {
        if (t > now)
            integrate([&m](Real, const std::vector<Real>& x, std::vector<Real>& dx) { derivative(m, x, dx); }, now, t, kTolerance, y);
        now = std::max(now, t);
        for (std::size_t k = 0; k < m.bodies.size(); ++k) {
            const Real* s = y.data() + kState * k;
            states[m.bodies[k]] = {
                {s[0], s[1], s[2]}, Quat(s[3], s[4], s[5], s[6]).normalized(), {s[7], s[8], s[9]}, {s[10], s[11], s[12]}};
        }
        out.push_back(states);
    }
    return out;
}

// What the reference depends on. Times that differ in their last bits alone share one.
std::uint64_t key_of(const Scene& scene, const std::vector<Real>& times) {
    Hasher hasher;
    const auto add = [&hasher](const Vec3& v) {
        for (int k = 0; k < 3; ++k) hasher.add(v[k]);
    };
    add(scene.gravity);
    for (const BodyDef& b : scene.bodies) {
        add(b.position);
        add(b.rotation.vec());
        add(b.linear_velocity);
        add(b.angular_velocity);
        hasher.add(b.mass);
    }
    for (const SceneJoint& j : scene.joints) {
        hasher.add(static_cast<Real>(j.def.type));
        add(j.def.anchor_a);
        add(j.def.anchor_b);
        add(j.def.axis);
    }
    for (const Real t : times) hasher.add(std::round(t * 1e9));
    return hasher.value();
}

}  // namespace

std::vector<std::vector<BodyState>> mechanism_reference(const Scene& scene, const std::vector<Real>& times) {
    static std::map<std::uint64_t, std::vector<std::vector<BodyState>>> known;  // runs of one scene ask for the same times again
    const std::uint64_t key = key_of(scene, times);
    const auto found = known.find(key);
    if (found != known.end()) return found->second;
    return known[key] = integrate_mechanism(scene, times);
}

}  // namespace cairn::cli
