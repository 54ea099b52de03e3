// From the kd-tree to the wide one.
#pragma once

#include "kdtree/tree.h"
#include "kdtree/wide_tree.h"

#include <functional>
#include <optional>

namespace mlrt {

// Makes the wide tree of all that a kd-tree refers to, by all threads. What a lazy tree has
// not built yet is built. Gives nothing if it was cancelled, which is asked on the calling
// thread only. Throws std::length_error if there are too many nodes or blocks, and
// std::bad_alloc.
//
// A ray that hits a referenced triangle at a point crosses the boxes of all nodes above one
// block that holds the triangle, at that point.
std::optional<WideTree> make_wide_tree(const KdTree &tree,
                                       const std::function<bool()> &cancelled = {});

} // namespace mlrt
