#include "solver/direct_problem.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

constexpr Real kKink = 1e-7;  // [m/s]

// Whether a row is expected inside its bounds by its multiplier alone. Between two updates w changes by about λ / D, which says nothing
// about bounds yet. At the kink, where nothing presses and nothing parts, a row holds: what begins to touch is to be carried.
bool holds(const DirectRow& r) {
    if (r.high == std::numeric_limits<Real>::infinity() && r.low == 0) return r.multiplier > 0 || r.slip <= kKink;
    const Real margin = 1e-3 * r.high;
    return r.low + margin < r.multiplier && r.multiplier < r.high - margin;
}

}  // namespace

Real exact_correction(const SolverBodies& bodies, const SiIsland& island, Real h) {
    Real a = 0;
    for (int i = island.body_begin; i < island.dynamic_end; ++i) a = std::max(a, bodies.motion[i].acceleration.norm());
    return 1e-3 * a * h;
}

void DirectProblem::set_rows() {
    s_.rows.resize(3 * static_cast<std::size_t>(points_.count()));
    s_.gradient.resize(static_cast<std::size_t>(count()));
    for_each_block([&](const ContactBlock& block) {
        DirectRow* row = rows_of(block);
        for (int i = 0; i < block.count; ++i, row += 3) {
            const NormalRow& normal = pool_.normals[block.first + i];
            const PointImpulse& impulse = pool_.impulse[block.first + i];
            const Real b = target(normal);
            const bool held = b > -kUnbounded;
            row[0] = {held ? b : 0, 0, held ? kUnbounded : 0, impulse.normal, impulse.normal, weight_ * normal.mass};
            for (int j = 0; j < 2; ++j) {
                row[1 + j] = {};
                if (block.friction < 0) continue;
                const Real start = impulse.friction[j], mass = pool_.frictions[block.friction + 2 * i + j].mass;
                const Real bound = friction_bound(block, impulse.normal, start, mass);
                row[1 + j] = {0, -bound, bound, start, start, weight_ * mass};
            }
        }
    });
}

void DirectProblem::start_sticking() {
    for_each_block([&](const ContactBlock& block) {
        if (block.friction < 0) return;
        DirectRow* row = rows_of(block);
        for (int i = 0; i < block.count; ++i, row += 3) {
            if (!row[0].active) continue;
            for (int j = 1; j < 3; ++j) {
                if (row[0].start > 0 && std::abs(row[j].start) >= 0.999 * row[j].high) continue;
                row[j].low = -kUnbounded;
                row[j].high = kUnbounded;
            }
        }
    });
}

void DirectProblem::copy_bodies() {
    s_.v0.assign(bodies_.velocity.begin() + island_.body_begin, bodies_.velocity.begin() + island_.dynamic_end);
    s_.inertia_W.resize(static_cast<std::size_t>(count()));
    for (int i = 0; i < count(); ++i) s_.inertia_W[i] = bodies_.motion[island_.body_begin + i].inv_inertia_W.inverse();
    has_bodies_ = true;
}

Real DirectProblem::pass(bool predict) {
    ++passes_;
    for (int i = 0; i < count(); ++i) {
        if (!has_bodies_) {
            s_.gradient[i].setZero();
            continue;
        }
        const BodyVelocity& v = bodies_.velocity[island_.body_begin + i];
        s_.gradient[i].head<3>() = (v.v - s_.v0[i].v) / bodies_.motion[island_.body_begin + i].inv_mass;
        s_.gradient[i].tail<3>() = s_.inertia_W[i] * (v.w - s_.v0[i].w);
    }
    Real residual = 0;
    for_each_block([&](const ContactBlock& block) {
        const BlockVelocity u(block, bodies_);
        Vec3 force = Vec3::Zero(), torque_a = Vec3::Zero(), torque_b = Vec3::Zero();
        const auto visit = [&](DirectRow& r, const Vec3& direction, const PointRow& g) {
            r.slip = u.along(direction, g) - r.target;
            const Real wanted = r.multiplier - r.weight * r.slip;
            r.impulse = std::clamp(wanted, r.low, r.high);
            r.active = r.low < wanted && wanted < r.high;
            if (predict && holds(r)) {
                r.impulse = wanted;
                r.active = true;
            }
            if (g.mass > 0)
                residual = std::max(residual, std::abs(r.multiplier - std::clamp(r.multiplier - g.mass * r.slip, r.low, r.high)) / g.mass);
            const Real change = r.impulse - r.start;
            if (change == 0) return;
            force += change * direction;
            torque_a += change * g.ang_a;
            torque_b += change * g.ang_b;
        };
        for_each_row(block, visit);
        if (const int a = local(block.a); a >= 0) {
            s_.gradient[a].head<3>() -= force;
            s_.gradient[a].tail<3>() -= torque_a;
        }
        if (const int b = local(block.b); b >= 0) {
            s_.gradient[b].head<3>() += force;
            s_.gradient[b].tail<3>() += torque_b;
        }
    });
    return residual;
}

void DirectProblem::accept(bool move_bounds) {
    for (int i = 0; i < count(); ++i) {
        const BodyMotion& m = bodies_.motion[island_.body_begin + i];
        bodies_.velocity[island_.body_begin + i].v -= m.inv_mass * s_.gradient[i].head<3>();
        bodies_.velocity[island_.body_begin + i].w -= m.inv_inertia_W * s_.gradient[i].tail<3>();
    }
    for (DirectRow& row : s_.rows) row.multiplier = row.impulse;
    if (move_bounds) set_bounds();
}

void DirectProblem::restore() {
    for (int i = 0; i < count(); ++i) bodies_.velocity[island_.body_begin + i] = s_.v0[i];
    for_each_block([&](const ContactBlock& block) {
        BlockVelocity u(block, bodies_);
        const auto apply = [&](const DirectRow& r, const Vec3& direction, const PointRow& g) {
            if (r.multiplier != r.start) u.apply(block, direction, g, r.multiplier - r.start);
        };
        for_each_row(block, apply);
        u.store(block, bodies_);
    });
}

void DirectProblem::start_again() {
    for (int i = 0; i < count(); ++i) bodies_.velocity[island_.body_begin + i] = s_.v0[i];
    for (DirectRow& row : s_.rows) row.multiplier = row.start;
    set_bounds();
}

void DirectProblem::set_bounds() {
    for_each_block([&](const ContactBlock& block) {
        if (block.friction < 0) return;
        DirectRow* row = rows_of(block);
        for (int i = 0; i < block.count; ++i, row += 3) {
            for (int j = 1; j < 3; ++j) {
                row[j].high =
                    friction_bound(block, row[0].multiplier, row[j].multiplier, pool_.frictions[block.friction + 2 * i + j - 1].mass);
                row[j].low = -row[j].high;
            }
        }
    });
}

bool DirectProblem::is_plausible() {
    constexpr Real kMostLeverage = 100;            // of wedges, arches and levers, over all there is
    Real momentum = 0, impulses = 0, largest = 0;  // [N s]
    for (int i = 0; i < count(); ++i) {
        const BodyMotion& m = bodies_.motion[island_.body_begin + i];
        momentum += (s_.v0[i].v.norm() + m.radius * s_.v0[i].w.norm()) / m.inv_mass;
    }
    for_each_block([&](const ContactBlock& block) {
        const auto add = [&](const DirectRow& r, const Vec3&, const PointRow& g) {
            impulses += std::abs(r.start) + g.mass * std::abs(r.target);
            largest = std::max(largest, std::abs(r.multiplier));
        };
        for_each_row(block, add);
    });
    return largest <= kMostLeverage * (momentum + impulses);
}

void DirectProblem::store() {
    for_each_block([&](const ContactBlock& block) {
        const DirectRow* row = rows_of(block);
        for (int i = 0; i < block.count; ++i, row += 3) {
            pool_.impulse[block.first + i].normal = row[0].multiplier;
            if (block.friction < 0) continue;
            pool_.impulse[block.first + i].friction[0] = row[1].multiplier;
            pool_.impulse[block.first + i].friction[1] = row[2].multiplier;
        }
    });
}

Real DirectProblem::target(const NormalRow& row) const {
    if (goal_ == DirectGoal::kVelocities) return velocity_target(row);
    const Real closing = closing_velocity(row, h_, exact_);
    const Real rate = goal_ == DirectGoal::kPush ? settings_.contact_push : 0;
    return closing <= exact_ ? closing : std::max(exact_, rate * closing);
}

Real DirectProblem::friction_bound(const ContactBlock& block, Real normal, Real friction, Real mass) const {
    const Real bound = block.mu * normal, wanted = std::abs(friction), room = 0.5 * exact_ * mass;
    if (wanted <= bound) return bound;
    if (goal_ == DirectGoal::kVelocities) return bound - std::min(0.1 * room, 0.5 * bound);
    return wanted <= bound + room ? wanted : bound;
}

}  // namespace cairn
