#include "base/huge_array.h"

#include "base/simd.h"

#include <cstdlib>
#include <new>
#include <sys/mman.h>

namespace mlrt {

namespace {

// What the processors that we build for call a huge page. Asking for less would be in vain.
constexpr uint64_t HUGE_PAGE = uint64_t(2) << 20;

// A wish: a kernel without huge pages says no, and small ones serve.
void ask_for_huge_pages([[maybe_unused]] void *pages, [[maybe_unused]] uint64_t bytes) {
#ifdef MADV_HUGEPAGE
    if (bytes >= HUGE_PAGE)
        madvise(pages, bytes, MADV_HUGEPAGE);
#endif
}

} // namespace

void *reserve_pages(uint64_t bytes) {
    void *pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED)
        throw std::bad_alloc();
    ask_for_huge_pages(pages, bytes);
    return pages;
}

void release_pages(void *pages, uint64_t bytes) {
    munmap(pages, bytes);
}

void *allocate_aligned(uint64_t bytes) {
    const uint64_t alignment = bytes >= HUGE_PAGE ? HUGE_PAGE : CACHE_LINE;
    void *memory =
        std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    if (!memory)
        throw std::bad_alloc();
    ask_for_huge_pages(memory, bytes / HUGE_PAGE * HUGE_PAGE);
    return memory;
}

} // namespace mlrt
