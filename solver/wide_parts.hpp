// How the blocks of a large island are dealt out to the threads of a team.
//
// The bodies are cut into parts across the island, and each block goes to a part of its bodies. A part's blocks are swept in the order of
// their levels (wide_contacts.hpp) by one thread at a time. Blocks of a body that several parts touch are the part's border: those of one
// level wait until the other parts have done their borders of all lower levels, and come first among their level, so that others need
// not wait for long. All other blocks wait for nobody. So each body sees its blocks in the order of the sequential sweep, and the result
// has the same bits for any number of parts.
//
// A part belongs to nobody: who is free takes it, and leaves it where it has to wait for one that nobody has; so one thread alone gets
// through as well. Memory is kept from step to step.
#pragma once

#include "engine/base/team.hpp"
#include "solver/contact_rows.hpp"

#include <algorithm>
#include <atomic>
#include <climits>
#include <cstdint>
#include <memory>
#include <vector>

namespace cairn {

class WideParts {
public:
    static constexpr int kMost = 8;

    // Where the blocks go, and how many levels there are. Where it pays to cut the island for `team` (null: there is none), several parts;
    // else one. `level`: of each block of the range; bodies: dynamic ones in [body_begin, body_end).
    void divide(const ContactPool& pool, BlockRange range, const std::vector<int>& level, int levels, const SolverBodies* bodies,
                int body_begin, int body_end, Team* team);
    int count() const { return count_; }
    // Of the block range.begin + k.
    int part_of(int k) const { return count_ == 1 ? 0 : part_of_block_[k]; }
    bool is_border(int k) const { return count_ > 1 && border_[k]; }

    // Batches are told in the order of parts, levels, and border or not.
    void begin_batches();
    void add_batches(int part, int level, bool border, int begin, int end);

    // f(begin, end) over the batches of each part, in any order.
    template <class F>
    void each_batch(F&& f) {
        each_part([&](int p) { f(parts_[p].first_batch, parts_[p].end_batch); });
    }
    // f(begin, end) over the bodies of each part, in any order. Returns the sum of what f returns.
    template <class F>
    std::uint64_t each_body(F&& f) {
        each_part([&](int p) {
            std::uint64_t sum = 0;
            for (const Range& r : bodies_[p]) sum += f(r.begin, r.end);
            parts_[p].sum = sum;
        });
        std::uint64_t sum = 0;
        for (int p = 0; p < count_; ++p) sum += parts_[p].sum;
        return sum;
    }
    // The same over batches, each after those that it waits for. Returns the largest of what f returns, and of 0.
    template <class F>
    double in_order(F&& f) {
        if (count_ == 1) return f(parts_[0].first_batch, parts_[0].end_batch);
        for (int p = 0; p < count_; ++p) start(parts_[p]);
        team_->together([&](int worker) { sweep(worker, f); });
        double most = 0;
        for (int p = 0; p < count_; ++p) most = std::max(most, parts_[p].most);
        return most;
    }

private:
    struct Range {
        int begin, end;
    };
    // Batches [begin, middle) wait for `level`, [middle, end) for nothing.
    struct Segment {
        int begin, middle, end, level;
    };
    struct alignas(64) Part {
        std::atomic<int> reached = 0;  // the level of its next border: those below are done
        alignas(64) std::atomic<bool> is_taken = false;
        std::atomic<bool> is_done = false;
        int next = 0;  // segment
        double most = 0;
        std::uint64_t sum = 0;
        int first_batch = 0, end_batch = 0;
        std::uint32_t neighbours = 0;  // parts that touch a body of its border: a bit each
        std::vector<Segment> segments;
    };

    struct Extent {
        Real lo, hi;
    };
    bool cut(const SolverBodies& bodies, int axis, Extent extent, int body_begin, int body_end, int count);
    void assign_blocks(const ContactPool& pool, BlockRange range, int body_begin);
    bool pays(const std::vector<int>& level, int levels, int blocks);
    void weigh_bodies(const ContactPool& pool, BlockRange range, int body_begin, int body_end);
    void collect_bodies(int body_begin, int body_end);
    static void start(Part& part);
    static int level_of(const Part& part, int segment) {
        return segment < static_cast<int>(part.segments.size()) ? part.segments[segment].level : INT_MAX;
    }
    bool may_go_on(const Part& part, int level) const;
    bool waits_for_nobody(const Part& part, int level) const;

    // Calls f(part) for each part, some of them by others.
    template <class F>
    void each_part(F&& f) {
        if (count_ == 1) return f(0);
        for (int p = 0; p < count_; ++p) parts_[p].is_taken.store(false, std::memory_order_relaxed);
        team_->together([&](int worker) {
            for (int i = 0; i < count_; ++i) {
                const int p = (worker + i) % count_;
                if (!parts_[p].is_taken.exchange(true, std::memory_order_acq_rel)) f(p);
            }
        });
        for (int p = 0; p < count_; ++p) parts_[p].is_taken.store(false, std::memory_order_relaxed);
    }

    // One thread's share of in_order: its own part first, then whatever is left.
    template <class F>
    void sweep(int worker, F& f) {
        for (Patience patience;;) {
            bool all_done = true, has_moved = false;
            for (int i = 0; i < count_; ++i) {
                Part& part = parts_[(worker + i) % count_];
                if (part.is_done.load(std::memory_order_acquire)) continue;
                all_done = false;
                if (part.is_taken.load(std::memory_order_relaxed) || part.is_taken.exchange(true, std::memory_order_acquire)) continue;
                has_moved |= advance(part, f);
                part.is_taken.store(false, std::memory_order_release);
            }
            if (all_done) return;
            if (!has_moved) patience.wait();
        }
    }

    // Goes on with a part until it is done or has to wait for one that nobody goes on with.
    template <class F>
    bool advance(Part& part, F& f) {
        if (part.is_done.load(std::memory_order_relaxed)) return false;
        const int from = part.next;
        for (; part.next < static_cast<int>(part.segments.size()); ++part.next) {
            const Segment s = part.segments[part.next];
            for (Patience patience; !may_go_on(part, s.level); patience.wait())
                if (waits_for_nobody(part, s.level)) return part.next != from;
            if (s.middle > s.begin) part.most = std::max(part.most, f(s.begin, s.middle));
            part.reached.store(level_of(part, part.next + 1), std::memory_order_release);
            if (s.end > s.middle) part.most = std::max(part.most, f(s.middle, s.end));
        }
        part.is_done.store(true, std::memory_order_release);
        return true;
    }

    int count_ = 1;
    Team* team_ = nullptr;
    std::unique_ptr<Part[]> parts_ = std::make_unique<Part[]>(kMost);
    std::vector<Range> bodies_[kMost];
    std::vector<std::uint8_t> part_of_body_, part_of_block_, border_;
    std::vector<std::uint32_t> touched_by_;  // of a body: the parts whose blocks touch it
    std::vector<double> weight_;             // of a body: points
    std::vector<int> sizes_;                 // scratch: blocks by level and part
};

}  // namespace cairn
