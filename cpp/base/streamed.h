// Writing what is not read again soon.
#pragma once

#include "base/simd.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace mlrt {

// Copies values to memory past the caches: whole lines of it are not read first, which
// takes as long as to write them. Other threads see them after finish_streaming().
inline void stream(float *out, const float *values, size_t count) {
    constexpr size_t LINE = CACHE_LINE / sizeof(float);
    const size_t in_line = uintptr_t(out) / sizeof(float) % LINE;
    const size_t before = std::min((LINE - in_line) % LINE, count);
    std::copy_n(values, before, out);
    size_t i = before;
    for (; i + LINE <= count; i += LINE) {
#if defined(__AVX512F__)
        _mm512_stream_ps(out + i, _mm512_loadu_ps(values + i));
#elif defined(__AVX__)
        for (size_t half = i; half < i + LINE; half += LINE / 2)
            _mm256_stream_ps(out + half, _mm256_loadu_ps(values + half));
#else
        std::copy_n(values + i, LINE, out + i);
#endif
    }
    std::copy_n(values + i, count - i, out + i);
}

inline void finish_streaming() {
#if defined(__SSE__)
    _mm_sfence();
#endif
}

} // namespace mlrt
