// The kd-tree as traversals see it.
#pragma once

#include "base/vec.h"
#include "geometry/triangle.h"
#include "kdtree/node.h"

#include <cstdint>
#include <span>
#include <vector>

namespace mlrt {

// A tree over triangles. Node 0 is the root and its cell is `bounds`; a cell is closed, so
// children share their split plane. A triangle is referenced by every leaf whose cell it touches,
// except that one lying in a split plane is given to one side only.
struct KdTree {
    Box3f bounds;                      // of all referenced triangles; empty for an empty tree
    std::vector<KdNode> nodes;         // at least one: an empty tree is one empty leaf
    std::vector<uint32_t> references;  // numbers of triangles, leaf by leaf
    std::vector<Triangle> triangles;   // every face that was given, in its order
    int depth = 0;                     // inner nodes on the longest path from the root

    std::span<const uint32_t> references_of(KdNode leaf) const {
        return {references.data() + leaf.first_reference(), leaf.reference_count()};
    }
};

// No path from the root to a leaf is longer than this: traversal stacks are sized by it.
inline constexpr int MAX_TREE_DEPTH = 64;

} // namespace mlrt
