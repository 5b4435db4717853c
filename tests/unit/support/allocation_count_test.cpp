#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"

#include <Eigen/Core>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

namespace {

// Allocations made by `work`. A volatile sink in the callers keeps the compiler from removing a new/delete pair (it may, [expr.new]).
template <class Work>
std::uint64_t allocations_of(Work work) {
    const std::uint64_t before = allocation_count::count();
    work();
    return allocation_count::count() - before;
}

void* volatile g_sink;

}  // namespace

TEST_CASE("every way to the heap is counted, and work that stays off it counts nothing") {
    if (!allocation_count::available()) {
        SUCCEED("a sanitizer owns malloc: nothing to count");
        CHECK(allocations_of([] { g_sink = std::make_unique<int>(1).get(); }) == 0);
        return;
    }
    CHECK(allocations_of([] {}) == 0);
    std::vector<int> reserved;
    reserved.reserve(8);
    CHECK(allocations_of([&] {
              reserved.assign(8, 1);
              g_sink = reserved.data();
          }) == 0);

    CHECK(allocations_of([] { g_sink = std::make_unique<int>(1).get(); }) == 1);
    CHECK(allocations_of([&] {
              reserved.resize(9);
              g_sink = reserved.data();
          }) == 1);
    // An over-aligned new goes through aligned_alloc.
    struct alignas(64) Line {
        double x[8];
    };
    CHECK(allocations_of([] { g_sink = std::make_unique<Line>().get(); }) == 1);
    // Eigen's dynamic matrices call malloc themselves.
    CHECK(allocations_of([] {
              Eigen::MatrixXd m(5, 5);
              g_sink = m.data();
          }) == 1);
    CHECK(allocations_of([] {
              void* block = std::calloc(3, 5);
              void* larger = std::realloc(block, 400);
              void* aligned = nullptr;
              CHECK(posix_memalign(&aligned, 64, 128) == 0);
              g_sink = aligned;
              std::free(larger);
              std::free(aligned);
          }) >= 3);
}

TEST_CASE("allocations of other threads are counted") {
    if (!allocation_count::available()) return;
    std::atomic<bool> go{false};
    std::atomic<bool> done{false};
    std::thread other([&] {
        while (!go) std::this_thread::yield();
        g_sink = std::make_unique<int>(1).get();
        done = true;
    });
    const std::uint64_t counted = allocations_of([&] {
        go = true;
        while (!done) std::this_thread::yield();
    });
    other.join();
    // At least one: the C library may allocate an arena or a thread's cache of its own, but not through malloc.
    CHECK(counted >= 1);
}
