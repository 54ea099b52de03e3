// What is done to a tree before rays from Python are traced.
#pragma once

#include "bind/ray_arrays.h"
#include "bind/watch.h"
#include "kdtree/tree.h"
#include "mlrta/trace.h"

namespace mlrt {

// Makes the wide tree for those that ask for it, or if it is worth it. Rays that all start
// in one point, as those of cameras and lamps do, need none. Throws as Widening::make(),
// and what a signal raises.
inline void prepare_tree(const KdTree &tree, const RayArrays &rays,
                         const TraceOptions &options) {
    Watch watch;
    {
        const nanobind::gil_scoped_release release;
        const auto ask = [&] { return watch(); };
        if (options.traversal == Traversal::wide)
            tree.widening->make(tree, ask);
        else if (options.traversal == Traversal::adaptive && !tree.widening->tree() &&
                 !tree.growth)
            tree.widening->make_for(
                tree, rays.seem_to_have_common_origin() ? 0 : rays.count(), ask);
    }
    watch.rethrow();
}

} // namespace mlrt
