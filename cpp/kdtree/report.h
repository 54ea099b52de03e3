// What a tree is like, found by walking it and not from what its builder counted.
#pragma once

#include "kdtree/tree.h"

#include <array>
#include <cstdint>

namespace mlrt {

// Expectations are of a line that crosses the cell of the root, as Mitsuba's kd-tree log
// gives them: a node is met with the chance A(cell) / A(root), A being the surface area.
// Cells of a lazy tree that are not built yet are neither inner nodes nor leaves.
struct TreeStatistics {
    uint64_t inner_nodes = 0;
    uint64_t leaves = 0;
    uint64_t empty_leaves = 0;
    uint64_t flat_leaves = 0; // not empty, and their cell has no extent along an axis
    uint64_t references = 0;
    uint64_t max_leaf_count = 0;
    uint64_t unbuilt_cells = 0;
    uint64_t unbuilt_references = 0;      // in cells that are not built yet
    int depth = 0;                        // inner nodes on the longest path from the root
    double expected_traversals = 0;       // inner nodes
    double expected_leaf_visits = 0;      // leaves, empty ones included
    double expected_primitive_visits = 0; // references in leaves
    std::array<uint64_t, 16> leaf_histogram{}; // leaves by references; longer ones left out
};

TreeStatistics statistics_of(const KdTree &tree);

} // namespace mlrt
