#include "solver/direct_solve.hpp"

#include "solver/contact_kernel.hpp"

#include <cmath>

namespace cairn {
namespace {

constexpr Real kUnbounded = std::numeric_limits<Real>::infinity();
constexpr int kUpdatesWithMovingBounds = 4;
// Newton steps at full length before the line search sets in: as a rule the active set settles by then.
constexpr int kFullSteps = 6;
constexpr Real kSmallChange = 1e-5;  // [m/s]
constexpr Real kKink = 1e-7;         // [m/s]

// One solve: its parts in the order in which direct_solve calls them.
class Solve {
public:
    Solve(SolverBodies& bodies, ContactPool& pool, const SiIsland& island, DirectGoal goal, Real h, const DirectSettings& settings,
          DirectCache& cache, DirectScratch& scratch, DirectReport& report, bool disturbed)
        : bodies_(bodies),
          pool_(pool),
          island_(island),
          goal_(goal),
          h_(h),
          settings_(settings),
          cache_(cache),
          s_(scratch),
          report_(report),
          points_(points_of(pool, island.contacts)),
          exact_(exact_correction()),
          disturbed_(disturbed) {}

    bool run() {
        set_rows();
        const Real at_start = pass(true);
        report_.residual = at_start;
        if (at_start <= (disturbed_ ? settings_.tolerance : settings_.start_tolerance)) return true;
        copy_bodies();
        // A small change is sought from the bounds as they are; a large one, or one that is not found so, from what sticks.
        Real residual = at_start <= kSmallChange ? update_multipliers(at_start) : kUnbounded;
        if (residual > settings_.start_tolerance) {
            start_again();
            start_sticking();
            pass(true);
            residual = update_multipliers(at_start);
        }
        if (residual > at_start) {
            start_again();
            residual = at_start;
        }
        store();
        report_.residual = residual;
        return residual <= settings_.start_tolerance;
    }

private:
    int count() const { return island_.dynamic_end - island_.body_begin; }
    // Index of a body among the island's dynamic ones, or < 0.
    int local(int body) const { return body >= island_.body_begin && body < island_.dynamic_end ? body - island_.body_begin : -1; }
    DirectRow* rows_of(const ContactBlock& block) { return s_.rows.data() + 3 * static_cast<std::size_t>(block.first - points_.begin); }

    template <typename Function>
    void for_each_block(Function f) {
        for (int k = island_.contacts.begin; k < island_.contacts.end; ++k) f(pool_.blocks[k]);
    }

    // Each row of a block with its direction and Jacobian: normal, friction 1, friction 2 of each point.
    template <typename Function>
    void for_each_row(const ContactBlock& block, Function f) {
        DirectRow* row = rows_of(block);
        for (int i = 0; i < block.count; ++i, row += 3) {
            f(row[0], block.n, pool_.normals[block.first + i]);
            if (block.friction < 0) continue;
            const FrictionRow* friction = &pool_.frictions[block.friction + 2 * i];
            f(row[1], friction[0].t, friction[0]);
            f(row[2], friction[1].t, friction[1]);
        }
    }

    // Small penetrations are taken back at once, by velocities up to exact_ that the second solve takes away again: the corners of a face
    // on another then ask for one and the same motion. If only gaps counted, and penetrations not, rounding would set one corner against
    // another.
    Real target(const NormalRow& row) const {
        if (goal_ == DirectGoal::kVelocities) return velocity_target(row);
        const Real closing = -(row.separation + 0.5 * h_ * h_ * row.curvature) / h_;
        const Real rate = goal_ == DirectGoal::kPush ? settings_.contact_push : 0;
        return closing <= exact_ ? closing : std::max(exact_, rate * closing);
    }

    // A thousandth of the velocity that the external accelerations make in a substep: nothing, where nothing presses bodies together.
    Real exact_correction() const {
        Real a = 0;
        for (int i = island_.body_begin; i < island_.dynamic_end; ++i) a = std::max(a, bodies_.motion[i].acceleration.norm());
        return 1e-3 * a * h_;
    }

    void set_rows() {
        s_.rows.resize(3 * static_cast<std::size_t>(points_.count()));
        s_.gradient.resize(static_cast<std::size_t>(count()));
        for_each_block([&](const ContactBlock& block) {
            DirectRow* row = rows_of(block);
            for (int i = 0; i < block.count; ++i, row += 3) {
                const NormalRow& normal = pool_.normals[block.first + i];
                const PointImpulse& impulse = pool_.impulse[block.first + i];
                const Real b = target(normal);
                const bool held = b > -kUnbounded;
                row[0] = {held ? b : 0, 0, held ? kUnbounded : 0, impulse.normal, impulse.normal, settings_.weight * normal.mass};
                for (int j = 0; j < 2; ++j) {
                    row[1 + j] = {};
                    if (block.friction < 0) continue;
                    const Real start = impulse.friction[j], mass = pool_.frictions[block.friction + 2 * i + j].mass;
                    const Real bound = friction_bound(block, impulse.normal, start, mass);
                    row[1 + j] = {0, -bound, bound, start, start, settings_.weight * mass};
                }
            }
        });
    }

    // What does not slide already is taken to stick until the loads are known: at first, tangential velocities are far from where friction
    // would leave them, and would say that everything slides.
    void start_sticking() {
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

    void copy_bodies() {
        s_.v0.assign(bodies_.velocity.begin() + island_.body_begin, bodies_.velocity.begin() + island_.dynamic_end);
        s_.inertia_W.resize(static_cast<std::size_t>(count()));
        for (int i = 0; i < count(); ++i) s_.inertia_W[i] = bodies_.motion[island_.body_begin + i].inv_inertia_W.inverse();
        has_bodies_ = true;
    }

    // Whether a row is expected inside its bounds by its multiplier alone. Between two updates w changes by about λ / D, which says nothing
    // about bounds yet. At the kink, where nothing presses and nothing parts, a row holds: what begins to touch is to be carried.
    static bool holds(const DirectRow& r) {
        if (r.high == kUnbounded && r.low == 0) return r.multiplier > 0 || r.slip <= kKink;
        const Real margin = 1e-3 * r.high;
        return r.low + margin < r.multiplier && r.multiplier < r.high - margin;
    }

    // w and proj(λ̂ − D w) of every row and the gradient at the present velocities. Returns the natural residual, which means something
    // where the velocities agree with λ̂. With `predict`, what `holds` is taken as active and not projected.
    Real pass(bool predict = false) {
        ++report_.passes;
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
                    residual =
                        std::max(residual, std::abs(r.multiplier - std::clamp(r.multiplier - g.mass * r.slip, r.low, r.high)) / g.mass);
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

    // Active, or at its lower or upper bound.
    static char state_of(const DirectRow& r) { return r.active ? 'a' : r.impulse == r.low ? 'l' : 'h'; }

    bool active_set_is(const std::vector<char>& set) const {
        if (set.size() != s_.rows.size()) return false;
        for (std::size_t k = 0; k < set.size(); ++k) {
            if (set[k] != state_of(s_.rows[k])) return false;
        }
        return true;
    }

    void note_active_set(std::vector<char>& set) const {
        set.resize(s_.rows.size());
        for (std::size_t k = 0; k < set.size(); ++k) set[k] = state_of(s_.rows[k]);
    }

    // H of the active rows, factorised.
    bool factorise() {
        BlockCholesky& factor = cache_.factor;
        factor.set_zero();
        for (int i = 0; i < count(); ++i) {
            Mat6 mass = Mat6::Zero();
            mass.diagonal().head<3>().setConstant(1 / bodies_.motion[island_.body_begin + i].inv_mass);
            mass.bottomRightCorner<3, 3>() = s_.inertia_W[i];
            factor.add_diagonal(i, mass);
        }
        int pair = 0;
        for_each_block([&](const ContactBlock& block) {
            const int a = local(block.a), b = local(block.b);
            Mat6 H_aa = Mat6::Zero(), H_ab = Mat6::Zero(), H_bb = Mat6::Zero();
            const auto add = [&](const DirectRow& r, const Vec3& direction, const PointRow& g) {
                if (!r.active) return;
                Vec6 j_a, j_b;
                j_a << direction, g.ang_a;
                j_b << -direction, -g.ang_b;
                const Vec6 weighted_a = r.weight * j_a, weighted_b = r.weight * j_b;
                H_aa.noalias() += weighted_a * j_a.transpose();
                H_ab.noalias() += weighted_a * j_b.transpose();
                H_bb.noalias() += weighted_b * j_b.transpose();
            };
            for_each_row(block, add);
            if (a >= 0) factor.add_diagonal(a, H_aa);
            if (b >= 0) factor.add_diagonal(b, H_bb);
            if (a >= 0 && b >= 0) factor.add_pair(pair++, H_ab);
        });
        ++report_.factorisations;
        fresh_ = true;
        note_active_set(cache_.factored_active);
        cache_.has_factor = factor.factorise();
        return cache_.has_factor;
    }

    // Newton's method for the multipliers and bounds as they are. False if the active set did not settle, or the matrix
    // could not be factorised.
    bool minimise() {
        for (int k = 0; k < settings_.most_newton_steps; ++k) {
            if ((!cache_.has_factor || !active_set_is(cache_.factored_active)) && !factorise()) return false;
            ++report_.newton_steps;
            s_.step = s_.gradient;
            cache_.factor.solve(s_.step);
            note_active_set(s_.active);
            const Real length = k < kFullSteps ? 1 : line_search();
            for (int i = 0; i < count(); ++i) {
                bodies_.velocity[island_.body_begin + i].v -= length * s_.step[i].head<3>();
                bodies_.velocity[island_.body_begin + i].w -= length * s_.step[i].tail<3>();
            }
            pass();
            if (length == 1 && active_set_is(s_.active)) return true;
        }
        return false;
    }

    // The α of (0, 1] that minimises along −step: the root of a piecewise linear, ascending derivative.
    Real line_search() {
        Real slope0 = 0, curvature = 0;  // of the quadratic part
        for (int i = 0; i < count(); ++i) {
            const Vec6& d = s_.step[i];
            const BodyVelocity& v = bodies_.velocity[island_.body_begin + i];
            const Real mass = 1 / bodies_.motion[island_.body_begin + i].inv_mass;
            const Vec3 I_d = s_.inertia_W[i] * d.tail<3>();
            curvature += mass * d.head<3>().squaredNorm() + d.tail<3>().dot(I_d);
            slope0 -= mass * d.head<3>().dot(v.v - s_.v0[i].v) + I_d.dot(v.w - s_.v0[i].w);
        }
        for_each_block([&](const ContactBlock& block) {
            const int a = local(block.a), b = local(block.b);
            const Vec6 none = Vec6::Zero();
            const Vec6 &d_a = a >= 0 ? s_.step[a] : none, &d_b = b >= 0 ? s_.step[b] : none;
            const Vec3 dv = d_a.head<3>() - d_b.head<3>();
            const auto visit = [&](DirectRow& r, const Vec3& direction, const PointRow& g) {
                r.along = -(direction.dot(dv) + g.ang_a.dot(d_a.tail<3>()) - g.ang_b.dot(d_b.tail<3>()));
            };
            for_each_row(block, visit);
        });
        const auto slope = [&](Real alpha) {
            Real sum = slope0 + alpha * curvature;
            for (const DirectRow& r : s_.rows)
                sum -= r.along * (std::clamp(r.multiplier - r.weight * (r.slip + alpha * r.along), r.low, r.high) - r.start);
            return sum;
        };
        const Real at_start = slope(0), at_end = slope(1);
        if (!(at_end > -1e-3 * at_start) || !(at_start < 0)) return 1;
        Real low = 0, high = 1, f_low = at_start, f_high = at_end;
        for (int k = 0; k < 12; ++k) {
            // Illinois' variant of regula falsi (Dowell, Jarratt 1971), kept off the ends.
            const Real middle =
                std::clamp((low * f_high - high * f_low) / (f_high - f_low), low + 0.01 * (high - low), high - 0.01 * (high - low));
            const Real f = slope(middle);
            if (std::abs(f) <= 1e-3 * -at_start) return middle;
            if (f > 0) {
                high = middle;
                f_high = f;
                f_low *= 0.5;
            } else {
                low = middle;
                f_low = f;
                f_high *= 0.5;
            }
        }
        return low > 0 ? low : high;
    }

    // Back to the velocities that agree with λ̂.
    void restore() {
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

    // Back to λ₀, v₀ and the bounds of λ₀.
    void start_again() {
        for (int i = 0; i < count(); ++i) bodies_.velocity[island_.body_begin + i] = s_.v0[i];
        for (DirectRow& row : s_.rows) row.multiplier = row.start;
        set_bounds();
    }

    void set_bounds() {
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

    // μ λ_N, but loads of points that share them without need (the corners of a face) are shared anew by every rounding, and no bound would
    // be the last: before the drift, friction that is over it by next to nothing may stay; after it, what is over it gets a little less and
    // so some room for the next update.
    Real friction_bound(const ContactBlock& block, Real normal, Real friction, Real mass) const {
        const Real bound = block.mu * normal, wanted = std::abs(friction), room = 0.5 * exact_ * mass;
        if (wanted <= bound) return bound;
        if (goal_ == DirectGoal::kVelocities) return bound - std::min(0.1 * room, 0.5 * bound);
        return wanted <= bound + room ? wanted : bound;
    }

    // λ̂ = λ = proj(λ̂ − D w), the velocities that agree with it, friction bounds by the new λ_N.
    void accept(bool move_bounds) {
        for (int i = 0; i < count(); ++i) {
            const BodyMotion& m = bodies_.motion[island_.body_begin + i];
            bodies_.velocity[island_.body_begin + i].v -= m.inv_mass * s_.gradient[i].head<3>();
            bodies_.velocity[island_.body_begin + i].w -= m.inv_inertia_W * s_.gradient[i].tail<3>();
        }
        for (DirectRow& row : s_.rows) row.multiplier = row.impulse;
        if (move_bounds) set_bounds();
    }

    // Updates of λ̂ until the residual is below the tolerance or does not fall any more. Returns it.
    Real update_multipliers(Real residual) {
        for (int update = 0; update < settings_.most_updates; ++update) {
            if (!minimise()) {
                restore();
                return kUnbounded;
            }
            accept(update < kUpdatesWithMovingBounds);
            const Real before = residual;
            residual = pass(true);
            if (residual <= settings_.tolerance) break;
            if (residual <= settings_.start_tolerance && residual > settings_.good_contraction * before) break;
            if (!fresh_ && residual > 0.1 * before) cache_.has_factor = false;
        }
        return residual;
    }

    void store() {
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

    SolverBodies& bodies_;
    ContactPool& pool_;
    const SiIsland& island_;
    DirectGoal goal_;
    Real h_;
    const DirectSettings& settings_;
    DirectCache& cache_;
    DirectScratch& s_;
    DirectReport& report_;
    PointRange points_;
    Real exact_;  // [m/s]
    bool disturbed_;
    bool has_bodies_ = false;  // v0 and inertia are set; before, the velocities are v0
    bool fresh_ = false;       // the factor is of this solve
};

}  // namespace

bool direct_solve(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island, DirectGoal goal, Real h,
                  const DirectSettings& settings, DirectCache& cache, DirectScratch& scratch, DirectReport& report, bool disturbed) {
    return Solve(bodies, contacts, island, goal, h, settings, cache, scratch, report, disturbed).run();
}

}  // namespace cairn
