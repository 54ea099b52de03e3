// The door of the tracer for rays in any order, of which nobody knows whether neighbours
// are neighbours in space. Answers are those of trace.h.
#pragma once

#include "mlrta/trace.h"

#include <cstdint>

namespace mlrt {

// As many rays as are best handed over at once.
uint32_t unordered_group_size(const TraceOptions &options, uint64_t rays);

// Whether squares of an image, of so many rays, had better be handed over by themselves.
bool squares_pay(const TraceOptions &options, uint32_t rays);

// Both sort the rays if that makes beams of neighbours much narrower, and the second one
// takes runs of them through shafts before. Those whose costs are asked for stay in their
// order. So do those of a square, in Morton order, unless they are not near one another.
void trace_closest_unordered(const KdTree &tree, const RayGroup &rays,
                             const TraceOptions &options, HitGroup hits, Counters &counters,
                             bool square = false);
void trace_any_unordered(const KdTree &tree, const RayGroup &rays,
                         const TraceOptions &options, uint8_t *occluded, Counters &counters,
                         bool square = false);

} // namespace mlrt
