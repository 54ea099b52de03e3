// What all walks through the wide tree share.
#pragma once

#include "geometry/triangle.h"
#include "kdtree/wide_tree.h"

#include <cstdint>

namespace mlrt {

// A wide tree, and the triangles that it has copies of.
struct WideScene {
    const WideNode *nodes;
    const WideBlock *blocks;
    uint64_t from_nodes_to_blocks; // in bytes
    WideChild root;
    const Triangle *triangles;

    WideScene(const WideTree &tree, const Triangle *all_triangles)
        : nodes(tree.nodes.data()), blocks(tree.blocks.data()),
          from_nodes_to_blocks(reinterpret_cast<uint64_t>(blocks) -
                               reinterpret_cast<uint64_t>(nodes)),
          root(tree.root), triangles(all_triangles) {}

    // Asks for the memory of a node or a block; which of both it is it finds without a
    // branch.
    void prefetch_child(WideChild child) const {
        static_assert(sizeof(WideBlock) == sizeof(WideNode) + CACHE_LINE);
        const auto of_block = -uint64_t(child.is_block());
        const uint64_t place =
            reinterpret_cast<uint64_t>(nodes) + (from_nodes_to_blocks & of_block) +
            child.index() * sizeof(WideNode) + (child.index() & of_block) * CACHE_LINE;
        prefetch(reinterpret_cast<const WideBlock *>(place));
    }
};

} // namespace mlrt
