// Memory for what a query returns.
#pragma once

#include "render/picture_memory.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>

namespace mlrt {

// Large arrays share the memory that pictures are kept in: pages that are new take as long
// as to trace a part of the rays. Small ones are had sooner from the C library; chosen.
inline constexpr uint64_t LARGE_RESULT_BYTES = uint64_t(1) << 20;

struct ResultDelete {
    uint64_t bytes = 0;

    void operator()(void *values) const {
        if (bytes >= LARGE_RESULT_BYTES)
            give_back_picture_memory(values, bytes);
        else
            std::free(values);
    }
};

template <typename T>
using ResultArray = std::unique_ptr<T[], ResultDelete>;

// Values that are not written yet. Throws std::bad_alloc.
template <typename T>
ResultArray<T> result_array(size_t count) {
    const uint64_t bytes = count * sizeof(T);
    void *const memory = bytes >= LARGE_RESULT_BYTES
                             ? take_picture_memory(bytes)
                             : std::malloc(std::max<uint64_t>(bytes, 1));
    if (!memory)
        throw std::bad_alloc();
    return {static_cast<T *>(memory), ResultDelete{bytes}};
}

} // namespace mlrt
