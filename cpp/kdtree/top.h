// The upper part of a tree: cells of many references, split one after the other by all
// threads together until what is left can be dealt out.
#pragma once

#include "kdtree/interruption.h"
#include "kdtree/partition.h"
#include "kdtree/subtree.h"

#include <span>
#include <vector>

namespace mlrt {

// A cell at the lower end of the upper part, with what lies in it.
struct Remainder {
    uint32_t node; // of the upper part
    Box3f cell;
    Allowance allowance;
    References references;
    std::shared_ptr<HugeArray<Reference>> list; // that the references lie in
};

struct Top {
    // Nodes as in a tree; the nodes of `remainders` are leaves to be replaced.
    std::vector<KdNode> nodes{1};
    std::vector<Box3f> cells;          // of the nodes
    std::vector<Remainder> remainders; // by increasing position in the tree, lower first
    BuildReport report;                // of the inner nodes and finished leaves
};

// Splits cells of more than `max_references`. Throws Cancelled.
Top build_top(HugeArray<Reference> references, const Box3f &bounds,
              std::span<const Triangle> triangles, const Allowance &allowance,
              const BuildFrame &frame, uint64_t max_references,
              const Interruption &interruption);

} // namespace mlrt
