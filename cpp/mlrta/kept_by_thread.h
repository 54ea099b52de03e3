// What a thread learned from the tiles of a tree for those to come: neighbouring tiles are
// mostly traced by the same thread.
#pragma once

#include "kdtree/tree.h"

#include <cstdint>

namespace mlrt {

// A Value of this thread for one Kind of use and one tree, new for another tree. It must
// not matter to hits.
template <typename Kind, typename Value>
Value &kept_by_thread(const KdTree &tree) {
    struct Kept {
        uint64_t identity = 0; // of no tree
        Value value;
    };
    thread_local Kept kept;
    if (kept.identity != tree.identity)
        kept = {tree.identity, {}};
    return kept.value;
}

} // namespace mlrt
