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
// children share their split plane.
//
// Every point of a referenced triangle lies in the cell of a leaf that references the
// triangle. A triangle that touches a split plane from one side is not referenced on the
// other side for that, and one lying in the plane is given to one side only. So a point in
// a split plane is found by whoever visits all cells that contain it, those that are
// entered just where the best hit lies included.
struct KdTree {
    Box3f bounds;              // of all referenced triangles; empty for an empty tree
    std::vector<KdNode> nodes; // at least one: an empty tree is one empty leaf
    std::vector<uint32_t> references; // numbers of triangles, leaf by leaf
    std::vector<Triangle> triangles;  // every face that was given, in its order
    int depth = 0;                    // inner nodes on the longest path from the root

    std::span<const uint32_t> references_of(KdNode leaf) const {
        return {references.data() + leaf.first_reference(), leaf.reference_count()};
    }
};

// No path from the root to a leaf is longer than this: traversal stacks are sized by it.
inline constexpr int MAX_TREE_DEPTH = 64;

} // namespace mlrt
