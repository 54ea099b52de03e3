// Groups of rays that are traced together, and what comes back for each of them.
#pragma once

#include "base/vec.h"
#include "geometry/triangle.h"

#include <cstdint>

namespace mlrt {

// Where the intervals of a group's rays begin, or where they end: each of them somewhere
// else, or all at one parameter.
class IntervalEnds {
public:
    IntervalEnds() = default;
    explicit IntervalEnds(const float *each) : each_(each) {}
    static IntervalEnds of_all(float common) {
        IntervalEnds ends;
        ends.common_ = common;
        return ends;
    }

    // The array, or null if there is one value for all rays, which is common().
    const float *each() const { return each_; }
    float common() const { return common_; }

    float operator[](uint32_t i) const { return each_ ? each_[i] : common_; }

private:
    const float *each_ = nullptr;
    float common_ = 0;
};

// Rays {origin + t * direction, t_min < t <= t_max}, one array a component. Directions need
// not have unit length; t is in units of the direction. Nothing behind the origin is hit: a
// negative t_min counts as zero. A ray with t_max <= t_min is inactive: it costs nothing
// and hits nothing. So is one with a component that is not finite or a direction of zero
// length.
//
// Neighbours in the group should be neighbours in space: packets are runs of consecutive
// rays, and a tile is split into runs of equal length. Pixels in Morton order have that
// property.
//
// Arrays are borrowed, hold `count` values and need no alignment or padding.
struct RayGroup {
    uint32_t count = 0;

    // Either all rays start at common_origin and `origin` is not looked at, or each has its
    // own.
    bool has_common_origin = false;
    Vec3f common_origin{};
    const float *origin[3]{};

    const float *direction[3]{};
    IntervalEnds t_min, t_max;

    // If given, what tracing takes is added here for each ray: nodes that are visited and
    // triangles that are tested, shared equally by rays for which that is done together. It
    // depends on how rays are grouped.
    float *cost = nullptr;
};

// Nearest hits: t and the number of the triangle, or infinity and NO_PRIMITIVE. Where t is
// not given nobody asks how far they are.
struct HitGroup {
    float *t = nullptr;
    uint32_t *primitive = nullptr;
};

} // namespace mlrt
