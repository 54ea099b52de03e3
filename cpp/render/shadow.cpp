#include "render/shadow.h"

#include <bit>
#include <limits>
#include <numeric>

namespace mlrt {

void ShadowCandidates::reset(size_t capacity) {
    count = 0;
    const size_t size = capacity + PACKET_WIDTH;
    if (ray.size() >= size)
        return;
    ray.resize(size);
    emitter.resize(size);
    for (int k = 0; k < 3; ++k) {
        origin[k].resize(size);
        direction[k].resize(size);
        contribution[k].resize(size);
    }
}

void ShadowCandidates::append(LaneBits lanes, const LaneArray<uint32_t> &of_ray,
                              const LaneArray<uint32_t> &to_emitter,
                              const Vec3<FloatPacket> &from, const Vec3<FloatPacket> &to,
                              const Vec3<FloatPacket> &light) {
    store_compressed(ray.data() + count, load<UIntPacket>(of_ray), lanes);
    store_compressed(emitter.data() + count, load<UIntPacket>(to_emitter), lanes);
    for (int k = 0; k < 3; ++k) {
        store_compressed(origin[k].data() + count, from[k], lanes);
        store_compressed(direction[k].data() + count, to[k] - from[k], lanes);
        store_compressed(contribution[k].data() + count, light[k], lanes);
    }
    count += uint32_t(std::popcount(lanes));
}

// A counting sort: it keeps the order of each emitter's candidates.
void ShadowTracer::sort_by_emitter(const ShadowCandidates &candidates) {
    order_.resize(candidates.count);
    if (scene_.data.emitters.size() == 1) {
        std::iota(order_.begin(), order_.end(), 0u);
        return;
    }
    next_.assign(scene_.data.emitters.size() + 1, 0);
    for (uint32_t i = 0; i < candidates.count; ++i)
        ++next_[candidates.emitter[i] + 1];
    std::partial_sum(next_.begin(), next_.end(), next_.begin());
    for (uint32_t i = 0; i < candidates.count; ++i)
        order_[next_[candidates.emitter[i]]++] = i;
}

void ShadowTracer::add_costs_to(const ShadowCandidates &candidates,
                                float *of_camera_rays) const {
    for (uint32_t i = 0; i < candidates.count; ++i)
        of_camera_rays[candidates.ray[order_[i]]] += costs_[i];
}

void ShadowTracer::trace_group(const ShadowCandidates &candidates,
                               std::span<const uint32_t> group, uint32_t number,
                               float *costs) {
    const size_t count = group.size();
    const Emitter &emitter = scene_.data.emitters[number];
    const bool is_point =
        emitter.type == EmitterType::point || emitter.type == EmitterType::spot;
    const bool from_light = offset_ == ShadowOffset::robust
                                ? scene_.emitter_tables[number].shadow_rays_from_light
                                : is_point;
    const float sign = from_light ? -1.0f : 1.0f;
    for (int k = 0; k < 3; ++k) {
        direction_[k].resize(count);
        for (size_t i = 0; i < count; ++i)
            direction_[k][i] = sign * candidates.direction[k][group[i]];
        if (from_light)
            continue;
        origin_[k].resize(count);
        for (size_t i = 0; i < count; ++i)
            origin_[k][i] = candidates.origin[k][group[i]];
    }
    if (offset_ == ShadowOffset::mitsuba) {
        t_min_.assign(count, from_light ? SHADOW_EPSILON : 0.0f);
        t_max_.assign(count, from_light ? 1.0f : 1.0f - SHADOW_EPSILON);
    } else {
        t_min_.assign(count, 0.0f);
        t_max_.assign(count, BEFORE_TARGET);
        // All rays are parallel, wherever they start, and nothing is behind the light.
        if (emitter.type == EmitterType::directional) {
            for (int k = 0; k < 3; ++k)
                direction_[k].assign(count, -emitter.direction[k]);
            t_max_.assign(count, std::numeric_limits<float>::max());
        }
    }
    occluded_.resize(count);

    RayGroup rays;
    rays.count = uint32_t(count);
    rays.has_common_origin = from_light;
    rays.common_origin = emitter.position;
    for (int k = 0; k < 3; ++k) {
        rays.origin[k] = from_light ? nullptr : origin_[k].data();
        rays.direction[k] = direction_[k].data();
    }
    rays.t_min = t_min_.data();
    rays.t_max = t_max_.data();
    rays.cost = costs;
    trace_any(*scene_.data.tree, rays, options_, occluded_.data(), counters_);
}

} // namespace mlrt
