// Memory that is asked for before it is needed.
#pragma once

#include <cstddef>

namespace mlrt {

inline constexpr size_t CACHE_LINE = 64;

// Asks for the cache lines of an object that will be read soon.
template <typename Object>
void prefetch(const Object *object) {
    const char *bytes = reinterpret_cast<const char *>(object);
    for (size_t at = 0; at < sizeof(Object); at += CACHE_LINE)
        __builtin_prefetch(bytes + at);
    if constexpr (CACHE_LINE % sizeof(Object) != 0 && alignof(Object) < CACHE_LINE)
        __builtin_prefetch(bytes + sizeof(Object) - 1);
}

} // namespace mlrt
