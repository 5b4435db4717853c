#include "apps/cli/allocations.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<std::uint64_t> g_allocations{0};
}  // namespace

namespace cairn::cli {
std::uint64_t allocations_so_far() {
    return g_allocations.load(std::memory_order_relaxed);
}
}  // namespace cairn::cli

// The library's new[] and nothrow forms call these.
void* operator new(std::size_t size) {
    g_allocations.fetch_add(1, std::memory_order_relaxed);
    for (;;) {
        if (void* p = std::malloc(size > 0 ? size : 1)) return p;
        const std::new_handler handler = std::get_new_handler();
        if (!handler) throw std::bad_alloc();
        handler();
    }
}

void operator delete(void* p) noexcept {
    std::free(p);
}

void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}
