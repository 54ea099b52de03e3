// Putting a subtree that was built on its own into the tree that it is part of.
#pragma once

#include "kdtree/subtree.h"

namespace mlrt {

// Copies all nodes but the root to `nodes` from `first_node` on, and the references to
// `references` from `first_reference` on. Returns the root as it is to stand in the tree.
KdNode relocate(const SubtreeArrays &subtree, uint64_t first_node, uint64_t first_reference,
                KdNode *nodes, uint32_t *references);

} // namespace mlrt
