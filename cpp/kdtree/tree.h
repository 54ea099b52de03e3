// The kd-tree as traversals see it.
#pragma once

#include "base/huge_array.h"
#include "base/vec.h"
#include "geometry/triangle.h"
#include "kdtree/node.h"
#include "kdtree/widening.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>

namespace mlrt {

class LazyGrowth;

// Not the one of any tree before, in this process.
inline uint64_t next_tree_identity() {
    static std::atomic<uint64_t> last{0};
    return ++last;
}

// A tree over triangles. Node 0 is the root and its cell is `bounds`; a cell is closed, so
// children share their split plane.
//
// Every point of a referenced triangle lies in the cell of a leaf that references the
// triangle. A triangle that touches a split plane from one side is not referenced on the
// other side for that, and one lying in the plane is given to one side only. So a point in
// a split plane is found by whoever visits all cells that contain it, those that are
// entered just where the best hit lies included.
struct KdTree {
    Box3f bounds;                   // of all referenced triangles; empty for an empty tree
    HugeArray<KdNode> nodes;        // at least one: an empty tree is one empty leaf
    HugeArray<uint32_t> references; // numbers of triangles, leaf by leaf
    HugeArray<Triangle> triangles;  // every face that was given, in its order
    int depth = 0;                  // inner nodes on the longest path from the root

    // What is remembered of a tree is looked up by it: other trees may come to lie where
    // this one did.
    uint64_t identity = next_tree_identity();

    // What is not built yet; none if all is. Nodes and references that are added lie in
    // the arrays' capacity.
    std::shared_ptr<LazyGrowth> growth;

    // Its form for rays that go alone.
    std::shared_ptr<Widening> widening = std::make_shared<Widening>();

    // The node, after building it if that has not been done. From any thread.
    KdNode node(uint32_t index) const {
        const KdNode node = load_node(nodes[index]);
        return node.is_unbuilt() ? built_node(index) : node;
    }

    std::span<const uint32_t> references_of(KdNode leaf) const {
        return {references.data() + leaf.first_reference(), leaf.reference_count()};
    }

private:
    KdNode built_node(uint32_t index) const;
};

// No path from the root to a leaf is longer than this: traversal stacks are sized by it.
inline constexpr int MAX_TREE_DEPTH = 64;

} // namespace mlrt
