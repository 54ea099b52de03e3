// One ray at a time through the wide tree: for rays that have little in common.
#pragma once

#include "base/counters.h"
#include "kdtree/wide_tree.h"
#include "traverse/query.h"
#include "traverse/single.h"
#include "traverse/wide_rays.h"

namespace mlrt {

// Rays take turns, as a step mostly waits for memory and for itself; `hits` has room for
// one each, in their order: those of triangle_test.h, as by every other traversal, but
// without distances of any hits. `triangles` are all of the scene. Directions must be
// moderate: those that load_packet() leaves active.
void trace_wide(const WideTree &tree, const Triangle *triangles, const WideRays &rays,
                Query query, Hit *hits, Counters &counters);

} // namespace mlrt
