// One ray at a time: for rays that have little in common.
#pragma once

#include "base/counters.h"
#include "traverse/query.h"
#include "traverse/ray_group.h"

#include <limits>
#include <span>

namespace mlrt {

// The ray {origin + t direction, t_min < t <= t_max}, finite and with a direction other
// than zero.
struct Ray {
    Vec3f origin, direction;
    float t_min = 0;
    float t_max = std::numeric_limits<float>::infinity();
};

// A ray of a group, which may be inactive.
Ray ray_of(const RayGroup &rays, uint32_t i);

// Infinity and NO_PRIMITIVE for a miss. A query for any hit reports the first one it finds.
struct Hit {
    float t = std::numeric_limits<float>::infinity();
    uint32_t primitive = NO_PRIMITIVE;
};

// X0: every finite triangle, without the tree.
Hit brute_force(const KdTree &tree, const Ray &ray, Query query, Counters &counters);

// X1: stack traversal of the tree. Directions of any magnitude are allowed.
Hit trace_single(const KdTree &tree, const Ray &ray, Query query, const Entry &entry,
                 Counters &counters);

// The same for several rays, which take turns: `hits` has room for one each. A step of one
// ray mostly waits for memory and for itself.
void trace_singles(const KdTree &tree, std::span<const Ray> rays, Query query,
                   const Entry &entry, Hit *hits, Counters &counters);

} // namespace mlrt
