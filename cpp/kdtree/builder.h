// Building the kd-tree: the exact event sweep.
#pragma once

#include "kdtree/tree.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace mlrt {

// Constants of the cost model and of the paper's three rules (Reshetov et al. 2005,
// section 3.2), each rule with a switch of its own.
struct BuildOptions {
    float traversal_cost = 1.0f;    // K_T: one step through an inner node
    float intersection_cost = 1.5f; // K_I: one packet against one triangle
    float empty_bonus = 0.8f; // factor on the cost of a split that cuts off empty space
    bool clip = true;         // "perfect splits": bounds of triangles clipped to the cell
    bool rule_empty_cell = true;   // rule 1
    bool rule_flat_cell = true;    // rule 2
    bool rule_area_floor = true;   // rule 3 (b)
    float empty_cell_share = 0.1f; // rule 1: least share of the cell's volume
    float area_floor = 0.0f;       // rule 3: share of the scene's area; 0 chooses by count
    int max_depth = 0; // of inner nodes on a path; 0 bounds the splits by count instead
};

// What the builder did; all counts are of the finished tree unless said otherwise.
struct BuildReport {
    uint64_t inner_nodes = 0;
    uint64_t leaves = 0;
    uint64_t empty_leaves = 0;
    uint64_t references = 0;
    uint64_t max_leaf_count = 0;
    int depth = 0;
    uint64_t empty_cell_splits = 0; // taken by rule 1
    uint64_t flat_cell_splits = 0;  // taken by rule 2
    uint64_t area_floor_leaves = 0; // ended by rule 3 (b)
    uint64_t dropped_triangles = 0; // not finite or of zero area: never referenced
    double sah_cost = 0; // expected cost of a ray, in units of traversal_cost = 1
    double seconds = 0;
};

struct BuiltTree {
    KdTree tree;
    BuildReport report;
};

// Builds a tree with perfect splits in O(N log N) (Wald and Havran 2006, section 4.3). The
// tree depends on nothing but the arguments.
std::optional<BuiltTree> build_kd_tree(std::vector<Triangle> triangles,
                                       const BuildOptions &options = {},
                                       const std::function<bool()> &cancelled = {});

} // namespace mlrt
