// Building the kd-tree: options, report, and the choice of the builder.
#pragma once

#include "kdtree/tree.h"

#include <cstdint>
#include <functional>
#include <optional>

namespace mlrt {

enum class Builder {
    automatic, // exact for small scenes, fast for large ones
    exact,     // sorted events: O(N log N), every plane is tried (Wald and Havran 2006)
    fast,      // bins: O(N log N), nearly as good, uses all threads
    lazy       // the fast builder's tree, built where rays go
};

// Constants of the cost model and of the paper's three rules (Reshetov et al. 2005,
// section 3.2), each rule with a switch of its own.
struct BuildOptions {
    Builder builder = Builder::automatic;
    // K_T: one step through an inner node, and K_I: one triangle of a leaf, of which beams
    // and the wide tree take eight at a time. Chosen from 0.02 to 1.5 by the frames of
    // office, conference, sponza, building and dragon: less is faster with one ray a pixel,
    // more with 16. Packets and single rays that walk this tree take less time with 1.5.
    float traversal_cost = 1.0f;
    float intersection_cost = 0.25f;
    float empty_bonus = 0.8f; // factor on the cost of a split that cuts off empty space
    bool clip = true;         // "perfect splits": bounds of triangles clipped to the cell
    bool rule_empty_cell = true;   // rule 1
    bool rule_flat_cell = true;    // rule 2
    bool rule_area_floor = true;   // rule 3 (b)
    float empty_cell_share = 0.1f; // rule 1: least share of the cell's volume
    float area_floor = 0.0f;       // rule 3: share of the scene's area; 0 chooses it
    int max_depth = 0; // of inner nodes on a path; 0 bounds the splits by count instead
};

// What the builder did; all counts are of the finished tree unless said otherwise.
struct BuildReport {
    Builder builder = Builder::exact; // that was chosen
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
    double sah_cost = 0;         // expected cost of a ray, in units of traversal_cost = 1
    double seconds = 0;          // in all; of which:
    double seconds_bounds = 0;   // bounds of the triangles
    double seconds_top = 0;      // the upper part, all threads on one cell after the other
    double seconds_subtrees = 0; // the lower part, a subtree a thread
    double seconds_join = 0;     // putting subtrees together

    // Adds the counts of another part of the tree.
    void add(const BuildReport &part);
};

struct BuiltTree {
    KdTree tree;
    BuildReport report;
};

// Builds a tree. It depends on nothing but the arguments, the number of threads least of
// all. Gives nothing if it was cancelled, which is asked on the calling thread only.
// Throws std::length_error for scenes that no tree can hold.
std::optional<BuiltTree> build_kd_tree(HugeArray<Triangle> triangles,
                                       const BuildOptions &options = {},
                                       const std::function<bool()> &cancelled = {});

} // namespace mlrt
