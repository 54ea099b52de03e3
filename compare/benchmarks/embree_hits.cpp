#include "embree_hits.h"

#include "base/parallel.h"
#include "geometry/triangle.h"

#include <algorithm>
#include <array>
#include <limits>

namespace mlrt::bench {

namespace {

constexpr size_t WIDTH = 16;
constexpr size_t RAYS_OF_A_TASK = 64 * WIDTH;
constexpr size_t STREAM = 256;
constexpr float INFINITE = std::numeric_limits<float>::infinity();

void trace_packet(const EmbreeScene &scene, const float *origins, const float *directions,
                  size_t count, RTCIntersectContextFlags flags, float *t,
                  uint32_t *primitives) {
    alignas(64) std::array<int, WIDTH> valid;
    RTCRayHit16 rays{};
    for (size_t i = 0; i < WIDTH; ++i) {
        const size_t from = 3 * std::min(i, count - 1);
        valid[i] = i < count ? -1 : 0;
        rays.ray.org_x[i] = origins[from];
        rays.ray.org_y[i] = origins[from + 1];
        rays.ray.org_z[i] = origins[from + 2];
        rays.ray.dir_x[i] = directions[from];
        rays.ray.dir_y[i] = directions[from + 1];
        rays.ray.dir_z[i] = directions[from + 2];
        rays.ray.tfar[i] = INFINITE;
        rays.ray.mask[i] = 0xffffffffu;
        rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = flags;
    rtcIntersect16(valid.data(), scene.handle(), &context, &rays);
    for (size_t i = 0; i < count; ++i) {
        const bool hit = rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        t[i] = hit ? rays.ray.tfar[i] : INFINITE;
        primitives[i] = hit ? rays.hit.primID[i] : NO_PRIMITIVE;
    }
}

// At most STREAM rays.
void trace_stream(const EmbreeScene &scene, const float *origins, const float *directions,
                  size_t count, float *t, uint32_t *primitives) {
    std::array<RTCRayHit, STREAM> rays;
    for (size_t i = 0; i < count; ++i) {
        RTCRay &ray = rays[i].ray;
        ray = {};
        ray.org_x = origins[3 * i];
        ray.org_y = origins[3 * i + 1];
        ray.org_z = origins[3 * i + 2];
        ray.dir_x = directions[3 * i];
        ray.dir_y = directions[3 * i + 1];
        ray.dir_z = directions[3 * i + 2];
        ray.tfar = INFINITE;
        ray.mask = 0xffffffffu;
        rays[i].hit.geomID = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcIntersect1M(scene.handle(), &context, rays.data(), uint32_t(count),
                   sizeof(RTCRayHit));
    for (size_t i = 0; i < count; ++i) {
        const bool hit = rays[i].hit.geomID != RTC_INVALID_GEOMETRY_ID;
        t[i] = hit ? rays[i].ray.tfar : INFINITE;
        primitives[i] = hit ? rays[i].hit.primID : NO_PRIMITIVE;
    }
}

} // namespace

void closest_hits(const EmbreeScene &scene, const float *origins, const float *directions,
                  size_t count, ArrayMode mode, float *t, uint32_t *primitives) {
    const RTCIntersectContextFlags flags = mode == ArrayMode::coherent_packets
                                               ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                               : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    const bool single = mode == ArrayMode::single_rays;
    const size_t at_once = single ? STREAM : WIDTH;
    const auto tasks = uint32_t((count + RAYS_OF_A_TASK - 1) / RAYS_OF_A_TASK);
    parallel_for(tasks, [&](uint32_t task) {
        const FlushDenormals flush;
        const size_t end = std::min(count, (task + size_t(1)) * RAYS_OF_A_TASK);
        for (size_t i = task * RAYS_OF_A_TASK; i < end; i += at_once) {
            const size_t some = std::min(at_once, end - i);
            if (single)
                trace_stream(scene, origins + 3 * i, directions + 3 * i, some, t + i,
                             primitives + i);
            else
                trace_packet(scene, origins + 3 * i, directions + 3 * i, some, flags, t + i,
                             primitives + i);
        }
    });
}

} // namespace mlrt::bench
