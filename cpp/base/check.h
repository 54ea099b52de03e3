// Assertions on what only this code can get wrong. They cost nothing unless the build asks
// for them; what a caller can get wrong is refused at the boundary, in bind/.
#pragma once

#ifdef MLRT_CHECKS
#include <cstdio>
#include <cstdlib>
#define MLRT_CHECK(condition)                                                              \
    do {                                                                                   \
        if (!(condition)) {                                                                \
            std::fprintf(stderr, "%s:%d: check failed: %s\n", __FILE__, __LINE__,          \
                         #condition);                                                      \
            std::abort();                                                                  \
        }                                                                                  \
    } while (false)
#else
#define MLRT_CHECK(condition) ((void)0)
#endif
