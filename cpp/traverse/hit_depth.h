// Hits of a ray by their depths t |d_k|, k being the axis along which triangles are seen
// (block_volumes.h): what beams and all walks through the wide tree decide by.
#pragma once

#include "base/counters.h"
#include "geometry/triangle.h"
#include "traverse/parameter_interval.h"

#include <cstdint>

namespace mlrt {

// Of a depth: the rounding of a distance to float, that of the product, and those of what
// follows.
inline constexpr float WIDEN_DEPTH = 8 * FLOAT_ROUNDOFF;
// More than what underflow may take from a depth.
inline constexpr float LEAST_DEPTH = 0x1p-120f;
// Distances below it are looked at more closely: they may be denormal, and then equal where
// depths differ. Chosen so large that none of its products is denormal, which takes
// processors a hundred cycles.
inline constexpr float SMALLEST_DISTANCE = 0x1p-60f;

// Not the distance of any hit.
inline constexpr float UNKNOWN_DISTANCE = -1;

// Of rays with a t_min and t_max, scalars or packets: hits less deep than the first are
// certainly not past t_min, as is the surface that a ray starts on; those deeper than the
// second are past it; and an end at t_max has a depth between the others.
template <typename Real>
Real last_depth_before(const Real &t_min, const Real &size) {
    return maximum(t_min * size * (1 - WIDEN_DEPTH) - LEAST_DEPTH, Real(0.0f));
}
template <typename Real>
Real first_certain_depth(const Real &t_min, const Real &size) {
    return maximum(t_min, Real(SMALLEST_DISTANCE)) * size * (1 + WIDEN_DEPTH) + LEAST_DEPTH;
}
template <typename Real>
Real least_depth_of_end(const Real &t_max, const Real &size) {
    return t_max * size * (1 - WIDEN_DEPTH) - LEAST_DEPTH;
}
template <typename Real>
Real greatest_depth_of_end(const Real &t_max, const Real &size) {
    return latest_distance(t_max) * size * (1 + WIDEN_DEPTH) + LEAST_DEPTH;
}

// A ray of which hits are compared one by one.
struct DepthRay {
    Vec3f origin, direction;
    float t_min, t_max;
    float size; // |d_k|
};

// The best hit of a ray so far: its triangle, its distance, unless that is left open, and
// bounds of its depth. Without a triangle these are bounds of the end's.
struct DepthHit {
    uint32_t primitive;
    float distance;
    float from, to;
};

// By the contract of triangle_test.h: makes a triangle the best hit, if it is; returns
// whether it did. It is a copy of number `primitive`, and it may be known that the ray
// goes through it.
bool decide_best(const DepthRay &ray, const Triangle &triangle, uint32_t primitive,
                 bool certainly_hit, const Triangle *triangles, DepthHit &best,
                 Counters &counters);

} // namespace mlrt
