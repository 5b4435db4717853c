// Threads that work on one thing after another together. One of them leads: it goes through its program and shares out what can be done
// side by side. The others help wherever something is being shared out, from whenever they come. The leader waits only for those who are
// in the middle of something, so it comes to its end alone as well: helpers may come late or never, and run one after the other with it on
// one thread.
//
// Sharing out takes about half a microsecond where helpers wait; they wait awake (pausing, then yielding). Allocates nothing.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <type_traits>

namespace cairn {

// To be called in a loop that waits for another thread: pauses some thousand times, then gives way to whoever else wants the processor.
class Patience {
public:
    void wait() {
        constexpr int kPauses = 2000;
        if (++waits_ > kPauses) return std::this_thread::yield();
#if defined(__x86_64__) || defined(__i386__)
        __builtin_ia32_pause();
#endif
    }

private:
    int waits_ = 0;
};

class Team {
public:
    // Of at most `size` threads, the leader among them.
    explicit Team(int size) : size_(size) {}
    int size() const { return size_; }

    // True for the first who asks: that one leads. The others call help().
    bool take_lead() { return !is_led_.exchange(true, std::memory_order_acq_rel); }
    // Helps until the leader has called finish(). At most size − 1 threads may.
    void help() {
        const int worker = 1 + helpers_.fetch_add(1, std::memory_order_relaxed);
        std::uint64_t last = 0;
        for (Patience patience;;) {
            std::uint64_t state = state_.load(std::memory_order_acquire);
            if ((state & kFinished) != 0) return;
            if ((state & kOpen) == 0 || (state & kTurn) == last ||
                !state_.compare_exchange_weak(state, state + kOneInside, std::memory_order_acq_rel)) {
                patience.wait();
                continue;
            }
            last = state & kTurn;
            call_(job_, worker);
            state_.fetch_sub(kOneInside, std::memory_order_release);
            patience = {};
        }
    }
    void finish() { state_.store(kFinished, std::memory_order_release); }

    // For the leader alone, and not from within what it shares out: calls f(0) here and f(worker), worker in [1, size), on helpers, at the
    // same time, each at most once; returns when all calls have returned. f must get everything done where f(0) alone is called.
    template <class F>
    void together(F&& f) {
        using Job = std::remove_reference_t<F>;
        if (size_ == 1) return f(0);
        job_ = const_cast<std::remove_const_t<Job>*>(&f);
        call_ = [](void* job, int worker) { (*static_cast<Job*>(job))(worker); };
        turn_ += kOneTurn;
        state_.store(turn_ | kOpen, std::memory_order_release);
        f(0);
        state_.fetch_and(~kOpen, std::memory_order_acq_rel);
        for (Patience patience; (state_.load(std::memory_order_acquire) & kInside) != 0;) patience.wait();
    }

    // f(begin, end, worker) for pieces [begin, end) of [0, count), of `piece` each. The leader takes them from the front, the others from
    // the back: so two threads go through the same halves each time, which then are in their caches.
    template <class F>
    void for_pieces(std::size_t count, std::size_t piece, F&& f) {
        if (size_ == 1 || count <= piece) {
            if (count > 0) f(std::size_t{0}, count, 0);
            return;
        }
        const std::uint64_t pieces = (count + piece - 1) / piece;
        std::atomic<std::uint64_t> left = pieces;  // those of [front, back), as front · 2³² + back
        together([&](int worker) {
            std::uint64_t range = left.load(std::memory_order_relaxed);
            for (;;) {
                const std::uint64_t front = range >> 32, back = range & UINT32_MAX;
                if (front == back) return;
                if (!left.compare_exchange_weak(range, worker == 0 ? range + (std::uint64_t{1} << 32) : range - 1,
                                                std::memory_order_relaxed))
                    continue;
                const std::size_t begin = piece * (worker == 0 ? front : back - 1);
                f(begin, begin + piece < count ? begin + piece : count, worker);
                range = left.load(std::memory_order_relaxed);
            }
        });
    }

private:
    // state_: how many are inside, whether they may come in, whether the leader has finished, and the number of the turn.
    static constexpr std::uint64_t kInside = 0xffff, kOneInside = 1, kOpen = 1 << 16, kFinished = 1 << 17, kOneTurn = 1 << 18;
    static constexpr std::uint64_t kTurn = ~(kOneTurn - 1);

    const int size_;
    std::atomic<bool> is_led_ = false;
    std::atomic<int> helpers_ = 0;
    void (*call_)(void* job, int worker) = nullptr;
    void* job_ = nullptr;
    std::uint64_t turn_ = 0;
    alignas(64) std::atomic<std::uint64_t> state_ = 0;
};

// The same without a team: all here, as worker 0.
template <class F>
void for_pieces(Team* team, std::size_t count, std::size_t piece, F&& f) {
    if (team != nullptr) return team->for_pieces(count, piece, f);
    if (count > 0) f(std::size_t{0}, count, 0);
}

}  // namespace cairn
