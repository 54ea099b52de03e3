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

} // namespace

void closest_hits(const EmbreeScene &scene, const float *origins, const float *directions,
                  size_t count, bool coherent, float *t, uint32_t *primitives) {
    const RTCIntersectContextFlags flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                    : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    const auto tasks = uint32_t((count + RAYS_OF_A_TASK - 1) / RAYS_OF_A_TASK);
    parallel_for(tasks, [&](uint32_t task) {
        const FlushDenormals flush;
        const size_t end = std::min(count, (task + size_t(1)) * RAYS_OF_A_TASK);
        for (size_t i = task * RAYS_OF_A_TASK; i < end; i += WIDTH)
            trace_packet(scene, origins + 3 * i, directions + 3 * i,
                         std::min(WIDTH, end - i), flags, t + i, primitives + i);
    });
}

} // namespace mlrt::bench
