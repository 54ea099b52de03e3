// Loops over many references.
#pragma once

#include "kdtree/crew.h"

#include <algorithm>
#include <cstdint>

namespace mlrt {

// Where chunks end depends on nothing but the number of elements: sums over them are the
// same for any number of threads.
inline constexpr uint64_t CHUNK = 16384;

inline uint32_t chunk_count(uint64_t count) {
    return uint32_t((count + CHUNK - 1) / CHUNK);
}

// Calls body(chunk, first, last) for each chunk of [0, count).
template <typename Body>
void for_each_chunk(uint64_t count, Crew &crew, Body &&body) {
    const auto run = [&](uint32_t chunk) {
        const uint64_t first = chunk * CHUNK;
        body(chunk, first, std::min(first + CHUNK, count));
    };
    const uint32_t chunks = chunk_count(count);
    if (chunks > 1)
        crew.run(chunks, run);
    else if (chunks == 1)
        run(0);
}

} // namespace mlrt
