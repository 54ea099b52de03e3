// Trees that were stored: what is checked before their numbers are trusted again.
#pragma once

#include "kdtree/tree.h"

#include <cstdint>

namespace mlrt {

// Trees of another number are not taken for those that would be built now. To be raised
// whenever a builder gives another tree for the same triangles and options, or when the
// layout of a node changes.
inline constexpr uint32_t BUILDER_VERSION = 2;

// Makes a tree of arrays that were stored: nodes, references, and the triangles that they
// were built for. Bounds and depth are found anew.
//
// Checks all that traversals rely on: children and references exist, every node has one
// parent at most and no path is longer than MAX_TREE_DEPTH, planes lie in their cells, and
// no triangle is referenced that a builder would have dropped. It takes time in proportion
// to the arrays, whatever they hold. Throws std::invalid_argument, which says what is
// wrong.
void restore(KdTree &stored);

} // namespace mlrt
