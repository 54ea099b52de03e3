#include "traverse/hit_depth.h"

#include "geometry/triangle_test.h"

#include <algorithm>
#include <cstring>

namespace mlrt {

bool decide_best(const DepthRay &ray, const Triangle &triangle, uint32_t primitive,
                 bool certainly_hit, const Triangle *triangles, DepthHit &best,
                 Counters &counters) {
    const uint32_t rival = best.primitive;
    // Of an equal triangle all is known.
    if (rival != NO_PRIMITIVE &&
        std::memcmp(&triangle, &triangles[rival], sizeof(Triangle)) == 0) {
        best.primitive = std::min(primitive, rival);
        return primitive < rival;
    }
    const Vec3f o = ray.origin, d = ray.direction;
    if (!certainly_hit) {
        const HitDecision decision = decide_hit(o, d, triangle);
        ++counters.double_tests;
        counters.exact_tests += decision.precision == Precision::exact;
        if (!decision.hit)
            return false;
    }
    const float t = hit_distance(o, d, triangle, counters);
    if (!(t > ray.t_min && t < INFINITE))
        return false;
    if (rival == NO_PRIMITIVE) {
        if (t > ray.t_max)
            return false;
    } else {
        if (best.distance == UNKNOWN_DISTANCE)
            best.distance = hit_distance(o, d, triangles[rival], counters);
        if (t > best.distance || (t == best.distance && primitive > rival))
            return false;
    }
    // In double, where a denormal distance is as far off as others.
    const double size = ray.size, least = double(SMALLEST_FLOAT);
    best = {primitive, t, float((t - least) * size * (1 - 0x1p-21)) - LEAST_DEPTH,
            float((t + least) * size * (1 + 0x1p-21)) + LEAST_DEPTH};
    return true;
}

} // namespace mlrt
