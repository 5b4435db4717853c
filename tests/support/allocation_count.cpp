#include "tests/support/allocation_count.hpp"

#include <atomic>
#include <cerrno>
#include <cstdlib>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CAIRN_COUNTS_ALLOCATIONS 1
#else
#define CAIRN_COUNTS_ALLOCATIONS 0
#endif

namespace {
// Constant-initialised: malloc is called before any constructor has run.
std::atomic<std::uint64_t> g_count{0};
}  // namespace

namespace allocation_count {
bool available() {
    return CAIRN_COUNTS_ALLOCATIONS != 0;
}
std::uint64_t count() {
    return g_count.load(std::memory_order_relaxed);
}
}  // namespace allocation_count

#if CAIRN_COUNTS_ALLOCATIONS
extern "C" {

// The C library's own functions, under the names it exports for programs that replace malloc.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

void* malloc(std::size_t size) {
    g_count.fetch_add(1, std::memory_order_relaxed);
    return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
    g_count.fetch_add(1, std::memory_order_relaxed);
    return __libc_calloc(count, size);
}

void* realloc(void* old, std::size_t size) {
    g_count.fetch_add(1, std::memory_order_relaxed);
    return __libc_realloc(old, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
    g_count.fetch_add(1, std::memory_order_relaxed);
    return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
    g_count.fetch_add(1, std::memory_order_relaxed);
    return __libc_memalign(alignment, size);
}

int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    g_count.fetch_add(1, std::memory_order_relaxed);
    void* block = __libc_memalign(alignment, size);
    if (block == nullptr) return ENOMEM;
    *out = block;
    return 0;
}

}  // extern "C"
#endif
