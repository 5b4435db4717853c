// Contact rows of large islands, four blocks at a time.
//
// A row visit waits for the one before it, whatever the width of its vectors; blocks that share no dynamic body need not wait for each
// other. Blocks are put into levels, one above the highest level of an earlier block that shares a dynamic body with them (the graph of
// what waits for what; list scheduling), and batches of four are cut from each level, the last one
// filled up from the next level. Every block still comes after the earlier ones that it shares a body with, so the result of a sweep is
// that of the sequential one to the last bit, with any number of lanes: the order that carries loads (from the ground up) stays.
//
// Rows with restitution stay with the sequential kernels: large islands hardly have any.
//
// plan → pack → the kernel's stages → store; all lengths and signs as in contact_rows.hpp. Memory is kept from step to step.
#pragma once

#include "solver/point_load.hpp"
#include "solver/wide_data.hpp"
#include "solver/wide_parts.hpp"

#include <vector>

namespace cairn {

// The kernel of this processor that beats sequential sweeps; null: none does (with two doubles to a register the plain set's takes 1.7
// times as long as they do). Which one it is changes no bit of a result.
const WideKernel* best_wide_kernel();

class WideContacts {
public:
    explicit WideContacts(const WideKernel* kernel = best_wide_kernel()) : kernel_(kernel) {}

    // Groups the blocks of `range`, whose dynamic bodies are those of [body_begin, body_end). False: too little goes side by side to pay,
    // or there is no kernel. With a team and the bodies, all that follows is shared out where that pays (wide_parts.hpp).
    bool plan(const ContactPool& pool, BlockRange range, int body_begin, int body_end, const SolverBodies* bodies = nullptr,
              Team* team = nullptr);

    // Takes over the planned blocks, with normals, and the states of their points, and builds their rows at the poses of the bodies
    // [begin, end); totals start at 0. Asks nothing of the pool's rows and points but those that are posed.
    void pack(const ContactPool& pool, SolverBodies& bodies, int begin, int end, const PointLoad& load);
    // The largest warm impulse of a point along its normal, in one of the solves [N s].
    Real largest_warm() const;
    void scale_warm(Real scale);
    // Of the warm impulses that store() leaves, when the next step's are to be of another length.
    void scale_results(Real scale) { result_scale_ = scale; }
    // Leaves the impulses with the states of the points.
    void store();

    // Copies rows and impulses of the running substep to the pool, for others to look at.
    void unpack_rows(ContactPool& pool) const;

    // The next substep starts from no impulse.
    void forget_warm_start();

    // Copies the poses of bodies [begin, end), for rows to be built at.
    void copy_poses(const SolverBodies& bodies, int begin, int end);

    // The stages of a substep over all batches: names and meaning as in contact_rows.hpp. Sweeps return the largest change.
    void start_first(Real h) {
        in_order([=](const WideKernel& k, const WideView& s, int begin, int end) { k.start_first(s, begin, end, h); });
    }
    Real sweep_normals() {
        return parts_.in_order([this](int begin, int end) { return kernel_->sweep_normals(view_, begin, end); });
    }
    Real sweep_velocities() {
        return parts_.in_order([this](int begin, int end) { return kernel_->sweep_velocities(view_, begin, end); });
    }
    void hold(Real h, Real rate) {
        in_order([=](const WideKernel& k, const WideView& s, int begin, int end) { k.hold(s, begin, end, h, rate); });
    }
    void push() {
        in_order([](const WideKernel& k, const WideView& s, int begin, int end) { k.push(s, begin, end); });
    }
    void advance(Real h, Real tolerance) {
        parts_.each_batch([&](int begin, int end) { kernel_->advance(view_, begin, end, h, tolerance); });
    }
    void start_second() {
        in_order([](const WideKernel& k, const WideView& s, int begin, int end) { k.start_second(s, begin, end); });
    }
    void keep_impulse_share(Real share);
    void close() {
        parts_.each_batch([&](int begin, int end) { kernel_->close(view_, begin, end); });
    }
    // f(begin, end) over the planned dynamic bodies, in any order. Returns the sum of what f returns.
    template <class F>
    std::uint64_t each_body(F&& f) {
        return parts_.each_body(f);
    }

    // Into so many parts that may be swept side by side.
    int part_count() const { return parts_.count(); }
    int batch_count() const { return static_cast<int>(batch_begin_.size()) - 1; }
    // The planned blocks of a batch in the pool's numbers: `lanes` of them, at most kLanes.
    int lanes_of(int batch) const { return batch_begin_[batch + 1] - batch_begin_[batch]; }
    int block_of(int batch, int lane) const { return order_[batch_begin_[batch] + lane]; }

private:
    template <class F>
    void in_order(F&& f) {
        parts_.in_order([&](int begin, int end) {
            f(*kernel_, view_, begin, end);
            return 0.0;
        });
    }
    void sort_blocks(BlockRange range, const ContactPool& pool, int levels);
    void cut_batches(const ContactPool& pool, int levels, int body_begin);
    void pack_batch(const ContactPool& pool, int batch);

    const WideKernel* kernel_;
    WideView view_{};
    WideParts parts_;
    int point_count_ = 0;  // of the batches
    Real result_scale_ = 1;
    std::vector<int> order_;         // blocks by part and level
    std::vector<int> batch_begin_;   // size batches + 1, in order_
    std::vector<int> level_;         // of a block
    std::vector<int> next_level_;    // of a body: find_levels()
    std::vector<int> slots_, fill_;  // scratch of the sort,
    std::vector<int> sorted_;        // and what comes of it
    std::vector<std::uint8_t> placed_;
    std::vector<int> last_batch_;  // of a body: that it has been put in so far
    std::vector<WideBatch> batches_;
    std::vector<WideBatchBuild> builds_;
    std::vector<WideNormal> normals_;
    std::vector<WideFriction> frictions_;
    std::vector<WidePoint> points_;
    std::vector<Wide> normal_impulse_, friction_impulse_, normal_held_, friction_held_;
    std::vector<WideWarm> warm_;
    std::vector<WideImpulse> total_;
    std::vector<WidePose> poses_;
};

}  // namespace cairn
