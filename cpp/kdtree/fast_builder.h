// The fast builder: the upper part with all threads on one cell, then a subtree a thread.
#pragma once

#include "kdtree/builder.h"
#include "kdtree/interruption.h"
#include "kdtree/reference.h"
#include "kdtree/subtree.h"

namespace mlrt {

// Fills nodes and references of `tree`, whose bounds and triangles are given, and adds to
// `report`. Throws Cancelled, and std::length_error for trees beyond what indices reach.
void build_fast(KdTree &tree, BuildReport &report, HugeArray<Reference> references,
                const BuildFrame &frame, const Interruption &interruption);

} // namespace mlrt
