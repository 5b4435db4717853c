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

namespace {
void* counted(std::size_t size) {
    g_allocations.fetch_add(1, std::memory_order_relaxed);
    return std::malloc(size > 0 ? size : 1);
}

void* counted_or_throw(std::size_t size) {
    for (;;) {
        if (void* p = counted(size)) return p;
        const std::new_handler handler = std::get_new_handler();
        if (!handler) throw std::bad_alloc();
        handler();
    }
}
}  // namespace

// Every unaligned form, so that whatever was allocated here is freed here: the address sanitizer brings its own of the forms left out.
void* operator new(std::size_t size) {
    return counted_or_throw(size);
}

void* operator new[](std::size_t size) {
    return counted_or_throw(size);
}

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    return counted(size);
}

void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
    return counted(size);
}

void operator delete(void* p) noexcept {
    std::free(p);
}

void operator delete[](void* p) noexcept {
    std::free(p);
}

void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}

void operator delete[](void* p, std::size_t) noexcept {
    std::free(p);
}

void operator delete(void* p, const std::nothrow_t&) noexcept {
    std::free(p);
}

void operator delete[](void* p, const std::nothrow_t&) noexcept {
    std::free(p);
}
