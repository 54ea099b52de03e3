// What is asked of a ray, and the part of the tree that the answer is looked for in.
#pragma once

#include "kdtree/tree.h"

#include <cstdint>

namespace mlrt {

// Every traversal is written once for both.
enum class Query { closest, any };

// A subtree: a node and its cell. Rays that start here find what they would find from the
// root, if the subtree is an entry point for them.
struct Entry {
    uint32_t node = 0;
    Box3f cell;
};

inline Entry root_entry(const KdTree &tree) {
    return {0, tree.bounds};
}

} // namespace mlrt
