#include "base/huge_array.h"

#include <new>
#include <sys/mman.h>

namespace mlrt {

namespace {

// What the processors that we build for call a huge page. Asking for less would be in vain.
constexpr uint64_t HUGE_PAGE = uint64_t(2) << 20;

} // namespace

void *reserve_pages(uint64_t bytes) {
    void *pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED)
        throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    // A wish: a kernel without huge pages says no, and small ones serve.
    if (bytes >= HUGE_PAGE)
        madvise(pages, bytes, MADV_HUGEPAGE);
#endif
    return pages;
}

void release_pages(void *pages, uint64_t bytes) {
    munmap(pages, bytes);
}

} // namespace mlrt
