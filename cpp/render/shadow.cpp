#include "render/shadow.h"

#include "base/lane_bits.h"
#include "mlrta/trace_unordered.h"
#include "objects/trace_objects.h"

#include <algorithm>
#include <limits>
#include <span>

namespace mlrt {

ShadowRays::ShadowRays(const PreparedScene &scene, uint32_t number, ShadowOffset offset)
    : light_position_(scene.data.emitters[number].position) {
    const Emitter &emitter = scene.data.emitters[number];
    if (offset == ShadowOffset::mitsuba) {
        from_light_ = is_at_point(emitter.type);
        begin_ = from_light_ ? SHADOW_EPSILON : 0.0f;
        end_ = from_light_ ? 1.0f : 1.0f - SHADOW_EPSILON;
        return;
    }
    from_light_ = scene.emitter_tables[number].shadow_rays_from_light;
    begin_ = 0;
    end_ = BEFORE_TARGET;
    // All rays are parallel, wherever they start, and nothing is behind the light.
    if (emitter.type == EmitterType::directional) {
        parallel_ = -emitter.direction;
        end_ = std::numeric_limits<float>::max();
    }
}

void ShadowRays::grow(size_t size) {
    size = std::max(size, 2 * occluded_.size());
    for (int k = 0; k < 3; ++k) {
        origin_[k].resize(from_light_ ? 0 : size);
        direction_[k].resize(size);
    }
    occluded_.resize(size);
    packets_.resize(size); // of a lane at least
}

void ShadowRays::find_occluded(const SceneData &scene, const TraceOptions &options,
                               Counters &counters, float *cost,
                               const ReflectedLight &light) {
    RayGroup rays;
    rays.count = count_;
    rays.has_common_origin = from_light_;
    rays.common_origin = light_position_;
    for (int k = 0; k < 3; ++k) {
        rays.origin[k] = from_light_ ? nullptr : origin_[k].data();
        rays.direction[k] = direction_[k].data();
    }
    rays.t_min = IntervalEnds::of_all(begin_);
    rays.t_max = IntervalEnds::of_all(end_);
    if (cost) {
        cost_.assign(count_, 0.0f);
        rays.cost = cost_.data();
    }
    if (from_light_)
        trace_any(*scene.tree, rays, options, occluded_.data(), counters);
    else
        trace_any_unordered(*scene.tree, rays, options, occluded_.data(), counters);
    if (scene.objects)
        trace_any_objects(*scene.objects, rays, occluded_.data(), counters);
    if (!cost)
        return;
    const float *of_ray = cost_.data();
    for (const Packet &packet : std::span(packets_).first(packet_count_)) {
        const LaneArray<uint32_t> rays = to_lanes<uint32_t>(light.rays(packet.number));
        for_each_lane(packet.lanes, [&](uint32_t lane) { cost[rays[lane]] += *of_ray++; });
    }
}

void ShadowRays::trace(const SceneData &scene, const TraceOptions &options,
                       Counters &counters, float *cost, ReflectedLight &light) {
    if (count_ == 0)
        return;
    find_occluded(scene, options, counters, cost, light);
    const uint8_t *occluded = occluded_.data();
    for (const Packet &packet : std::span(packets_).first(packet_count_)) {
        light.show(packet.number, spread_to(packet.lanes, zero_bytes(occluded)));
        occluded += std::popcount(packet.lanes);
    }
}

} // namespace mlrt
