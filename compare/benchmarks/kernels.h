// The traversal of packets with other tests of triangles than the core's exact one, to tell
// what exactness costs: the same tree, the same steps, another test.
#pragma once

#include "kdtree/tree.h"
#include "stopwatch.h"
#include "traverse/ray_group.h"

#include <cstdint>

namespace mlrt::bench {

// Tests of triangles, all without a tolerance:
// - single_precision, double_precision: Moeller and Trumbore 1997, "Fast, minimum storage
//   ray/triangle intersection";
// - pluecker: signed volumes over the edges seen from the origin, in single precision, as
//   in Davidovic, Engelhardt, Georgiev, Slusallek and Dachsbacher 2012;
// - sheared: Woop, Benthin and Wald 2013, "Watertight ray/triangle intersection", in single
//   precision, without its second try in double;
// - exact: the test of the core.
enum class Kernel : uint32_t {
    single_precision,
    double_precision,
    pluecker,
    sheared,
    exact
};

// Nearest hits of rays with origins of their own, in packets from the root, on all threads
// of the pool. The tree must be finished. Directions so large or small that single
// precision could lose them are not for this: such rays miss.
Seconds trace_with(const KdTree &tree, Kernel kernel, const RayGroup &rays, HitGroup hits);

} // namespace mlrt::bench
