// The rows of one solve of the direct solver and what is done to all of them. Internal to this room.
#pragma once

#include "solver/contact_kernel.hpp"
#include "solver/direct_solve.hpp"

#include <limits>

namespace cairn {

// [m/s], a thousandth of the velocity that the external accelerations make in a substep: nothing, where nothing presses bodies together.
Real exact_correction(const SolverBodies& bodies, const SiIsland& island, Real h);

// [m/s], the relative normal velocity over the drift that takes a row to where it touches. What is nearer than a hundredth of `exact` h
// touches: where a point is to 1e-8 m does not say which corners of a face bear its load.
inline Real closing_velocity(const NormalRow& row, Real h, Real exact) {
    const Real closing = -(row.separation + 0.5 * h * h * row.curvature) / h;
    return closing - std::clamp(closing, -0.01 * exact, 0.01 * exact);
}

class DirectProblem {
public:
    DirectProblem(SolverBodies& bodies, ContactPool& pool, const SiIsland& island, DirectGoal goal, Real h, Real weight,
                  const DirectSettings& settings, DirectScratch& scratch)
        : bodies_(bodies),
          pool_(pool),
          island_(island),
          goal_(goal),
          h_(h),
          weight_(weight),
          settings_(settings),
          s_(scratch),
          points_(points_of(pool, island.contacts)),
          exact_(exact_correction(bodies, island, h)) {}

protected:
    static constexpr Real kUnbounded = std::numeric_limits<Real>::infinity();

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

    void set_rows();

    // What does not slide already is taken to stick until the loads are known: at first, tangential velocities are far from where friction
    // would leave them, and would say that everything slides.
    void start_sticking();

    void copy_bodies();

    // w and proj(λ̂ − D w) of every row and the gradient at the present velocities. Returns the natural residual, which means something
    // where the velocities agree with λ̂. With `predict`, what `holds` is taken as active and not projected.
    Real pass(bool predict = false);

    // λ̂ = λ = proj(λ̂ − D w), the velocities that agree with it, friction bounds by the new λ_N.
    void accept(bool move_bounds);

    // Back to the velocities that agree with λ̂.
    void restore();

    // Back to λ₀, v₀ and the bounds of λ₀.
    void start_again();

    void set_bounds();

    // Whether the impulses are of the size of what there was to be stopped, carried and moved. A body that friction holds between two
    // others can bear any impulse along which nothing moves, so bounds that follow the normal impulses may grow without end, and the
    // velocities say nothing of it.
    bool is_plausible();

    void store();

    // Small penetrations are taken back at once, by velocities up to exact_ that the second solve takes away again: the corners of a face
    // on another then ask for one and the same motion. If only gaps counted, and penetrations not, rounding would set one corner against
    // another.
    Real target(const NormalRow& row) const;

    // μ λ_N, but loads of points that share them without need (the corners of a face) are shared anew by every rounding, and no bound would
    // be the last: before the drift, friction that is over it by next to nothing may stay; after it, what is over it gets a little less and
    // so some room for the next update.
    Real friction_bound(const ContactBlock& block, Real normal, Real friction, Real mass) const;

    SolverBodies& bodies_;
    ContactPool& pool_;
    const SiIsland& island_;
    DirectGoal goal_;
    Real h_;
    Real weight_;  // D in units of a row's effective mass
    const DirectSettings& settings_;
    DirectScratch& s_;
    PointRange points_;
    Real exact_;  // [m/s]
    std::uint64_t passes_ = 0;
    bool has_bodies_ = false;  // v0 and inertia are set; before, the velocities are v0
};

}  // namespace cairn
