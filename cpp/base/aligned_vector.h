// Vectors of numbers that packets are loaded from and stored to.
#pragma once

#include "base/simd.h"

#include <cstddef>
#include <new>
#include <vector>

namespace mlrt {

// Memory that begins with a cache line, so that no packet at a multiple of its width spans
// two of them, which would take as long as two packets.
template <typename T>
struct AlignedAllocator {
    using value_type = T;

    AlignedAllocator() = default;
    template <typename U>
    AlignedAllocator(const AlignedAllocator<U> &) {}

    T *allocate(size_t count) {
        return static_cast<T *>(
            ::operator new(count * sizeof(T), std::align_val_t(CACHE_LINE)));
    }
    void deallocate(T *values, size_t count) {
        ::operator delete(values, count * sizeof(T), std::align_val_t(CACHE_LINE));
    }
    friend bool operator==(const AlignedAllocator &, const AlignedAllocator &) {
        return true;
    }
};

template <typename T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

} // namespace mlrt
