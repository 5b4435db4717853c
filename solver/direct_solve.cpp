#include "solver/direct_solve.hpp"

#include "solver/direct_problem.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

constexpr int kUpdatesWithMovingBounds = 4;
constexpr Real kMostWeightScale = 1e4;
// Newton steps at full length before the line search sets in: as a rule the active set settles by then.
constexpr int kFullSteps = 6;
constexpr Real kSmallChange = 1e-5;  // [m/s]

constexpr int kMostChanges = 16;
using SmallMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, 0, kMostChanges, kMostChanges>;
using SmallVector = Eigen::Matrix<Real, Eigen::Dynamic, 1, 0, kMostChanges, 1>;
// What a block of the factor costs in a solve, and a solve at least, in products of blocks; and the share of a factorisation that changed
// rows may cost.
constexpr double kSolveCost = 0.35, kLeastSolveCost = 20, kWorthOfFactor = 0.7;

// One solve: its parts in the order in which direct_solve calls them.
class Solve : DirectProblem {
public:
    Solve(SolverBodies& bodies, ContactPool& pool, const SiIsland& island, DirectGoal goal, Real h, const DirectSettings& settings,
          DirectCache& cache, DirectScratch& scratch, DirectReport& report)
        : DirectProblem(bodies, pool, island, goal, h, settings.weight * cache.weight_scale, settings, scratch),
          cache_(cache),
          report_(report) {}

    bool run(Real enough) {
        s_.spread.resize(kMostChanges);
        set_rows();
        const Real at_start = pass(true);
        report_.residual = at_start;
        report_.passes = passes_;
        if (at_start <= enough) return true;
        copy_bodies();
        // A small change is sought from the bounds as they are; a large one, or one that is not found so, from what sticks.
        Real residual = at_start <= kSmallChange ? update_multipliers(at_start) : kUnbounded;
        if (residual > settings_.start_tolerance) {
            start_again();
            start_sticking();
            pass(true);
            residual = update_multipliers(at_start);
        }
        if (!(residual <= at_start) || !is_plausible()) {
            start_again();
            residual = at_start;
        }
        store();
        report_.passes = passes_;
        report_.residual = residual;
        return residual <= settings_.start_tolerance;
    }

private:
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

    // H of the active rows, factorised. False if it cannot be, or no more of them may be.
    bool factorise() {
        cache_.has_factor = false;
        if (--s_.factorisations_left < 0) return false;
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
        cache_.has_factor = factor.factorise(settings_.team);
        return cache_.has_factor;
    }

    // How many changed rows are cheaper to correct for than to factorise anew: a solve for each, and one for the step.
    std::size_t most_changes() const {
        const double solve = kSolveCost * static_cast<double>(cache_.factor.blocks()) + kLeastSolveCost;
        const double worth = kWorthOfFactor * static_cast<double>(cache_.factor.products()) / solve - 1;
        return static_cast<std::size_t>(std::clamp(worth, 0.0, static_cast<double>(kMostChanges)));
    }

    // The rows that are active and were not when H was factorised, or the other way round. False: there are too many of them.
    bool find_changes() {
        s_.changes.clear();
        if (active_set_is(cache_.factored_active)) return true;
        const std::size_t most = most_changes();
        if (most == 0 || cache_.factored_active.size() != s_.rows.size()) return false;
        std::size_t k = 0, count = 0;
        for (const DirectRow& r : s_.rows) count += (cache_.factored_active[k++] == 'a') != r.active;
        if (count > most) return false;
        if (count == 0) return true;
        for_each_block([&](const ContactBlock& block) {
            const auto visit = [&](const DirectRow& r, const Vec3& direction, const PointRow& g) {
                const bool was_active = cache_.factored_active[&r - s_.rows.data()] == 'a';
                if (was_active == r.active) return;
                DirectChange change{local(block.a), local(block.b), {}, {}, r.active ? r.weight : -r.weight};
                change.g_a << direction, g.ang_a;
                change.g_b << -direction, -g.ang_b;
                s_.changes.push_back(change);
            };
            for_each_row(block, visit);
        });
        return true;
    }

    static Real along(const DirectChange& change, const std::vector<Vec6>& x) {
        return (change.a >= 0 ? change.g_a.dot(x[change.a]) : 0) + (change.b >= 0 ? change.g_b.dot(x[change.b]) : 0);
    }

    // step ← (H + Uᵀ C U)⁻¹ gradient, U the changed rows, C their weights (Woodbury 1950; Hager 1989):
    //     x = H⁻¹ g,  Z = H⁻¹ Uᵀ,  step = x − Z (C⁻¹ + U Z)⁻¹ U x.
    void solve_changed() {
        const int n = static_cast<int>(s_.changes.size());
        if (n == 0) return cache_.factor.solve(s_.step);
        const auto solve_column = [&](int j, int worker) {
            if (j == n) return cache_.factor.solve(s_.step, worker);
            const DirectChange& change = s_.changes[j];
            std::vector<Vec6>& z = s_.spread[j];
            z.assign(static_cast<std::size_t>(count()), Vec6::Zero());
            if (change.a >= 0) z[change.a] = change.g_a;
            if (change.b >= 0) z[change.b] = change.g_b;
            cache_.factor.solve(z, worker);
        };
        for_pieces(settings_.team, static_cast<std::size_t>(n) + 1, 1, [&](std::size_t begin, std::size_t end, int worker) {
            for (std::size_t j = begin; j < end; ++j) solve_column(static_cast<int>(j), worker);
        });
        SmallMatrix S(n, n);
        SmallVector y(n);
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) S(i, j) = along(s_.changes[i], s_.spread[j]);
            S(j, j) += 1 / s_.changes[j].weight;
            y[j] = along(s_.changes[j], s_.step);
        }
        const SmallVector share = Eigen::PartialPivLU<SmallMatrix>(S).solve(y);
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < count(); ++i) s_.step[i] -= share[j] * s_.spread[j][i];
    }

    // Newton's method for the multipliers and bounds as they are. False if the active set did not settle, or the matrix
    // could not be factorised.
    bool minimise() {
        for (int k = 0; k < settings_.most_newton_steps; ++k) {
            const bool serves = cache_.has_factor && find_changes();
            if (!serves) {
                s_.changes.clear();
                if (!factorise()) return false;
            }
            ++report_.newton_steps;
            s_.step = s_.gradient;
            solve_changed();
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

    // The same rows over and over, and hardly better: bodies much heavier than the lightest of a row's two, or many of them that sway as
    // one, want a larger D. It stays, for it takes little to raise it and much to find out.
    void raise_weights() {
        constexpr Real kRaise = 100;
        for (DirectRow& row : s_.rows) row.weight *= kRaise;
        cache_.weight_scale *= kRaise;
        cache_.has_factor = false;
        pass(true);
    }

    // Updates of λ̂ until the residual is below the tolerance or does not fall any more. Returns it.
    Real update_multipliers(Real residual) {
        for (int update = 0; update < settings_.most_updates; ++update) {
            const std::uint64_t steps_before = report_.newton_steps;
            if (!minimise()) {
                restore();
                return kUnbounded;
            }
            const bool one_step = report_.newton_steps == steps_before + 1;
            accept(update < kUpdatesWithMovingBounds);
            const Real before = residual;
            residual = pass(true);
            if (residual <= settings_.tolerance) break;
            const bool slow = residual > 0.1 * before && cache_.weight_scale < kMostWeightScale;
            if (residual <= settings_.start_tolerance && residual > settings_.good_contraction * before) {
                if (slow && one_step && before > 0.1 * settings_.start_tolerance) raise_weights();
                break;
            }
            if (residual <= 0.1 * before) continue;
            const bool was_fresh = fresh_;
            if (!fresh_) cache_.has_factor = false;
            // Before, it may come from bounds that move.
            if (slow && one_step && was_fresh && update + 1 >= kUpdatesWithMovingBounds) raise_weights();
        }
        return residual;
    }

    DirectCache& cache_;
    DirectReport& report_;
    bool fresh_ = false;  // the factor is of this solve
};

}  // namespace

bool direct_solve(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island, DirectGoal goal, Real h,
                  const DirectSettings& settings, DirectCache& cache, DirectScratch& scratch, DirectReport& report, Real enough) {
    return Solve(bodies, contacts, island, goal, h, settings, cache, scratch, report).run(enough);
}

}  // namespace cairn
