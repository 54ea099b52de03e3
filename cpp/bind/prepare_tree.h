// What is done to a tree before rays from Python are traced.
#pragma once

#include "bind/ray_arrays.h"
#include "kdtree/tree.h"
#include "mlrta/trace.h"

namespace mlrt {

// Makes the wide tree for those that ask for it, or if it is worth it. Rays that all start
// in one point, as those of cameras and lamps do, need none. Throws as Widening::make().
inline void prepare_tree(const KdTree &tree, const RayArrays &rays,
                         const TraceOptions &options) {
    const nanobind::gil_scoped_release release;
    if (options.traversal == Traversal::wide)
        tree.widening->make(tree);
    else if (options.traversal == Traversal::adaptive && !tree.widening->tree() &&
             !tree.growth)
        tree.widening->make_for(tree, rays.have_common_origin() ? 0 : rays.count());
}

} // namespace mlrt
