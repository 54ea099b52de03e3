// Loops over many references, by one thread or by all.
#pragma once

#include "base/parallel.h"

#include <algorithm>
#include <cstdint>

namespace mlrt {

// Where chunks end depends on nothing but the number of elements: sums over them are the
// same for any number of threads.
inline constexpr uint64_t CHUNK = 16384;

inline uint32_t chunk_count(uint64_t count) {
    return uint32_t((count + CHUNK - 1) / CHUNK);
}

enum class Threads { one, all };

// Calls body(chunk, first, last) for each chunk of [0, count).
template <typename Body>
void for_each_chunk(uint64_t count, Threads threads, Body &&body) {
    const auto run = [&](uint32_t chunk) {
        const uint64_t first = chunk * CHUNK;
        body(chunk, first, std::min(first + CHUNK, count));
    };
    const uint32_t chunks = chunk_count(count);
    if (threads == Threads::all && chunks > 1)
        parallel_for(chunks, run);
    else
        for (uint32_t chunk = 0; chunk < chunks; ++chunk)
            run(chunk);
}

} // namespace mlrt
