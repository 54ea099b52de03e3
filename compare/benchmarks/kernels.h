// The traversal of packets with other tests of triangles than the core's exact one, to tell
// what exactness costs: the same tree, the same steps, another test.
#pragma once

#include "kdtree/tree.h"
#include "stopwatch.h"
#include "traverse/ray_group.h"

#include <cstdint>

namespace mlrt::bench {

// Moeller and Trumbore 1997, "Fast, minimum storage ray/triangle intersection", without a
// tolerance, in single or double precision; or the test of the core.
enum class Kernel : uint32_t { single_precision, double_precision, exact };

// Nearest hits of rays with origins of their own, in packets from the root, on all threads
// of the pool. The tree must be finished. Directions so large or small that single
// precision could lose them are not for this: such rays miss.
Seconds trace_with(const KdTree &tree, Kernel kernel, const RayGroup &rays, HitGroup hits);

} // namespace mlrt::bench
