#include "engine/foresight.hpp"

#include "collision/features.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Of the smaller shape's size: a pair that goes less far until it meets meets with the features that are nearest now.
constexpr Real kLongWay = 0.01;
// [rad] in the step, of a pair that touches or nearly does, from which on others of its features may come down.
constexpr Real kTurn = 0.01;
// Sine of the angle up to which capsules touch side by side (collision/narrow_segments.cpp), at least.
constexpr Real kParallel = 0.02;
constexpr Real kRounding = 1e-9;  // of the size

Vec3 velocity_at(const Body& body, const Vec3& point) {
    return body.v + body.w.cross(point - body.X_WB.p);
}

Real least_separation(const std::vector<Manifold>& found) {
    Real least = found.front().points[0].separation;
    for (const Manifold& m : found)
        for (int i = 0; i < m.count; ++i) least = std::min(least, m.points[i].separation);
    return least;
}

// When the first point closes; `dt` if none does within the step.
Real meeting_time(const Body& a, const Body& b, const std::vector<Manifold>& found, Real dt) {
    Real first = dt;
    for (const Manifold& m : found) {
        for (int i = 0; i < m.count; ++i) {
            const ManifoldPoint& p = m.points[i];
            const Real closing = -m.n.dot(velocity_at(a, p.core_a) - velocity_at(b, p.core_b));
            if (closing * first > p.separation) first = p.separation / closing;
        }
    }
    return first;
}

bool has_feature(const std::vector<Manifold>& found, int count, std::uint32_t sub_key, std::uint32_t feature) {
    for (int k = 0; k < count; ++k) {
        const Manifold& m = found[k];
        if (m.sub_key != sub_key) continue;
        for (int i = 0; i < m.count; ++i)
            if (m.points[i].feature == feature) return true;
    }
    return false;
}

Vec3 feature_rate(const Body& body, const ShapeRecord& shape) {
    const ShapeType type = shape.shape.type;
    const bool is_centred = shape.X_BS.p.isZero(0);  // else the turn also moves it
    if (!is_centred || (type != ShapeType::kCapsule && type != ShapeType::kCylinder)) return body.w;
    const Vec3 axis = body.X_WB.q * Vec3(shape.X_BS.R.col(2));
    return body.w - body.w.dot(axis) * axis;
}

bool axes_may_be_parallel(const Body& a, const ShapeRecord& shape_a, const Body& b, const ShapeRecord& shape_b, Real turn) {
    const Vec3 axis_a = a.R * shape_a.X_BS.R.col(2), axis_b = b.R * shape_b.X_BS.R.col(2);
    return axis_a.cross(axis_b).norm() <= kParallel + turn;
}

// A manifold on a face of a body.
struct OnFace {
    const Manifold& m;
    const Body& face;
    const Body& body;  // the other one
    const ShapeRecord& shape;
    Vec3 rate;  // [rad/s], of `body` against `face`
    int side;   // 1: `body` is A
    Vec3 arm(const ManifoldPoint& p) const { return (side > 0 ? p.core_a : p.core_b) - body.X_WB.p; }
    Real radius(const ManifoldPoint& p) const { return side > 0 ? p.radius_a : p.radius_b; }
};

// Whether something of the body is below the face at the step's end, and lower than the manifold's points. Over the face, what is at r from
// the body's centre is then at the height base + r·up_end, to second order in the turn.
bool face_may_be_met(const OnFace& c, Real dt) {
    if (c.shape.shape.is_static_only()) return true;
    const Vec3 up = c.side * c.m.n, turn = dt * c.rate;
    const Vec3 tilt = up.cross(turn), up_end = up + tilt + 0.5 * tilt.cross(turn);
    const Vec3 v = c.body.v - velocity_at(c.face, c.body.X_WB.p);
    const ManifoldPoint& first = c.m.points[0];
    const Real base = first.separation + c.radius(first) - up.dot(c.arm(first)) + dt * up.dot(v);
    Real lowest = 0;
    for (int i = 0; i < c.m.count; ++i) {
        const ManifoldPoint& p = c.m.points[i];
        lowest = std::min(lowest, base + up_end.dot(c.arm(p)) - c.radius(p));
    }
    const Real down = support({&c.shape.shape, c.shape.pose(c.body.transform())}, -up_end) + up_end.dot(c.body.X_WB.p);
    return base - down < lowest - kRounding * c.shape.size;
}

}  // namespace

Turning turning_of(const Body& a, const ShapeRecord& shape_a, const Body& b, const ShapeRecord& shape_b) {
    return {feature_rate(a, shape_a) - feature_rate(b, shape_b),
            shape_a.shape.type == ShapeType::kSphere || shape_b.shape.type == ShapeType::kSphere};
}

Foresight foresight_of(const Body& a, const Body& b, const Turning& turning, const std::vector<Manifold>& found, Real size, Real dt) {
    if (found.empty() || found.front().owner == NormalOwner::kCores) return {};
    const Real spin = turning.rate.norm();
    const Real gap = least_separation(found);
    const Real time = gap > 0 ? meeting_time(a, b, found, dt) : 0;
    Foresight foresight;
    if (time < dt && time * ((a.v - b.v).norm() + spin * size) >= kLongWay * size) foresight.meeting = time;
    const bool is_near = foresight.meeting > 0 || gap <= spin * dt * size;
    foresight.at_end = is_near && spin * dt >= kTurn && !turning.has_ball;
    return foresight;
}

bool may_come_down(const Body& a, const ShapeRecord& shape_a, const Body& b, const ShapeRecord& shape_b, const Turning& turning,
                   const std::vector<Manifold>& found, Real dt) {
    if (shape_a.shape.type == ShapeType::kCapsule && shape_b.shape.type == ShapeType::kCapsule)
        return axes_may_be_parallel(a, shape_a, b, shape_b, turning.rate.norm() * dt);
    return std::any_of(found.begin(), found.end(), [&](const Manifold& m) {
        switch (m.owner) {
            case NormalOwner::kA:
                return face_may_be_met({m, a, b, shape_b, -turning.rate, -1}, dt);
            case NormalOwner::kB:
                return face_may_be_met({m, b, a, shape_a, turning.rate, 1}, dt);
            case NormalOwner::kNone:
                return true;
            case NormalOwner::kCores:
                break;
        }
        return false;
    });
}

Transform pose_after(const Body& body, Real t) {
    if (body.type == BodyType::kStatic) return body.transform();
    return {(exp_rotation(t * body.w) * body.X_WB.q).toRotationMatrix(), body.X_WB.p + t * body.v};
}

void bring_back(std::vector<Manifold>& foreseen, const Transform& X_WA, const Transform& X_WB, const Transform& Y_WA,
                const Transform& Y_WB) {
    for (Manifold& m : foreseen) {
        if (m.owner == NormalOwner::kA) m.n = X_WA.R * (Y_WA.R.transpose() * m.n);
        if (m.owner == NormalOwner::kB) m.n = X_WB.R * (Y_WB.R.transpose() * m.n);
        for (int i = 0; i < m.count; ++i) {
            ManifoldPoint& p = m.points[i];
            p.core_a = X_WA * Y_WA.to_local(p.core_a);
            p.core_b = X_WB * Y_WB.to_local(p.core_b);
            p.separation = m.n.dot(p.core_a - p.core_b) - p.radius_a - p.radius_b;
        }
    }
}

void add_foreseen(std::vector<Manifold>& found, const std::vector<Manifold>& foreseen) {
    const int present = static_cast<int>(found.size());
    for (const Manifold& m : foreseen) {
        Manifold added = m;
        added.sub_key = m.sub_key ^ kForeseen;
        added.count = 0;
        for (int i = 0; i < m.count; ++i) {
            const ManifoldPoint& p = m.points[i];
            // What is overlapping now and yet was not found is no contact: a corner beside the face that it is measured against.
            if (p.separation >= 0 && !has_feature(found, present, m.sub_key, p.feature)) added.points[added.count++] = p;
        }
        if (added.count > 0) found.push_back(added);
    }
}

}  // namespace cairn
