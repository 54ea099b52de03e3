#include "render/shadow.h"

#include "base/lane_bits.h"
#include "mlrta/trace_unordered.h"
#include "objects/trace_objects.h"

#include <algorithm>
#include <bit>
#include <limits>

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

void ShadowRays::reserve(size_t size) {
    if (ray_.size() >= size)
        return;
    size = std::max(size, 2 * ray_.size());
    ray_.resize(size);
    for (int k = 0; k < 3; ++k) {
        origin_[k].resize(from_light_ ? 0 : size);
        direction_[k].resize(size);
    }
    occluded_.resize(size);
}

void ShadowRays::append(LaneBits lanes, const HitPacket &hit, const Vec3<FloatPacket> &from,
                        const Vec3<FloatPacket> &to, const Vec3<FloatPacket> &light) {
    reserve(count_ + PACKET_WIDTH);
    if (packet_count_ == packets_.size())
        packets_.resize(std::max<size_t>(PACKET_WIDTH, 2 * packets_.size()));
    Packet &packet = packets_[packet_count_++];
    packet.light = light;
    packet.first = hit.first;
    packet.lanes = lanes;
    const uint32_t first = count_;
    count_ += uint32_t(std::popcount(lanes));
    const bool from_light = from_light_;
    uint32_t *ray = ray_.data() + first;
    float *const direction[3] = {direction_[0].data() + first, direction_[1].data() + first,
                                 direction_[2].data() + first};
    store_compressed(ray, hit.ray, lanes);
    if (from_light) {
        for (int k = 0; k < 3; ++k)
            store_compressed(direction[k], from[k] - to[k], lanes);
        return;
    }
    for (int k = 0; k < 3; ++k) {
        store_compressed(&origin_[k][first], from[k], lanes);
        store_compressed(direction[k],
                         parallel_ ? FloatPacket((*parallel_)[k]) : to[k] - from[k], lanes);
    }
}

void ShadowRays::find_occluded(const SceneData &scene, const TraceOptions &options,
                               Counters &counters, float *cost) {
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
    for (uint32_t i = 0; cost && i < count_; ++i)
        cost[ray_[i]] += cost_[i];
}

void ShadowRays::trace(const SceneData &scene, const TraceOptions &options,
                       Counters &counters, float *cost,
                       std::span<float *const, 3> colours) {
    if (count_ == 0)
        return;
    find_occluded(scene, options, counters, cost);
    const uint8_t *occluded = occluded_.data();
    const uint32_t *ray = ray_.data();
    for (const Packet &packet : std::span(packets_).first(packet_count_)) {
        const LaneBits visible = spread_to(packet.lanes, zero_bytes(occluded));
        add_light(packet, visible, ray, colours);
        const int count = std::popcount(packet.lanes);
        occluded += count;
        ray += count;
    }
}

// `rays` are the camera rays of the lanes that have light, one after the other.
void ShadowRays::add_light(const Packet &packet, LaneBits visible, const uint32_t *rays,
                           std::span<float *const, 3> colours) {
    if (packet.first) {
        const auto mask = from_bits<FloatPacket>(visible);
        for (int k = 0; k < 3; ++k) {
            float *colour = colours[size_t(k)] + *packet.first;
            const FloatPacket before = load<FloatPacket>(colour);
            store(colour, select(mask, before + packet.light[k], before));
        }
        return;
    }
    for_each_lane(packet.lanes, [&](uint32_t lane) {
        for (int k = 0; k < 3 && ((visible >> lane) & 1u); ++k)
            colours[size_t(k)][*rays] += packet.light[k].entry(lane);
        ++rays;
    });
}

} // namespace mlrt
