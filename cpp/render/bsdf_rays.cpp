#include "render/bsdf_rays.h"

#include "base/lane_bits.h"
#include "base/partial_packets.h"
#include "mlrta/trace_unordered.h"
#include "objects/trace_objects.h"
#include "render/emitter_density.h"
#include "render/hit_packet.h"
#include "render/textured_light.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace mlrt {

SampleShares::SampleShares(uint32_t emitter_samples, uint32_t bsdf_samples) {
    // Without any sample nothing is shared.
    const float sum = float(std::max(emitter_samples + bsdf_samples, 1u));
    emitters = float(emitter_samples) / sum;
    bsdfs = float(bsdf_samples) / sum;
    emitter_weight = emitter_samples > 0 ? 1.0f / float(emitter_samples) : 0.0f;
    bsdf_weight = bsdf_samples > 0 ? 1.0f / float(bsdf_samples) : 0.0f;
}

void BsdfRays::reserve(size_t size) {
    if (ray_.size() >= size)
        return;
    size = std::max(size, 2 * ray_.size());
    ray_.resize(size);
    for (int k = 0; k < 3; ++k)
        for (std::vector<float> *array : {&start_[k], &p_[k], &direction_[k], &weight_[k]})
            array->resize(size);
    density_.resize(size);
    primitive_.resize(size);
    blocked_.resize(size);
    if (scene_.data.objects) {
        instance_.resize(size, NO_INSTANCE);
        t_.resize(size);
    }
}

void BsdfRays::append(const BsdfSamples &samples, const UIntPacket &ray,
                      const Vec3<FloatPacket> &start, const Vec3<FloatPacket> &p) {
    reserve(count_ + PACKET_WIDTH);
    store_compressed(&ray_[count_], ray, samples.lanes);
    for (int k = 0; k < 3; ++k) {
        store_compressed(&start_[k][count_], start[k], samples.lanes);
        store_compressed(&p_[k][count_], p[k], samples.lanes);
        store_compressed(&direction_[k][count_], samples.direction[k], samples.lanes);
        store_compressed(&weight_[k][count_], samples.weight[k], samples.lanes);
    }
    store_compressed(&density_[count_], samples.density, samples.lanes);
    count_ += uint32_t(std::popcount(samples.lanes));
}

RayGroup BsdfRays::group(float *cost) {
    RayGroup rays;
    rays.count = count_;
    for (int k = 0; k < 3; ++k) {
        rays.origin[k] = start_[k].data();
        rays.direction[k] = direction_[k].data();
    }
    rays.t_max = IntervalEnds::of_all(std::numeric_limits<float>::max());
    if (cost) {
        cost_.assign(count_, 0.0f);
        rays.cost = cost_.data();
    }
    return rays;
}

void BsdfRays::add_cost(float *cost) const {
    for (uint32_t i = 0; cost && i < count_; ++i)
        cost[ray_[i]] += cost_[i];
}

// Where light comes from faces only, rays that would meet none that glows if nothing were
// in their way.
void BsdfRays::leave_out_dark(const TraceOptions &options, Counters &counters,
                              float *cost) {
    if (!looks_for_light_first(scene_))
        return;
    const GlowingFaces &glowing = *scene_.glowing.of(scene_.data);
    const RayGroup rays = group(cost);
    trace_any(*glowing.tree, rays, options, blocked_.data(), counters);
    if (glowing.objects)
        trace_any_objects(*glowing.objects, rays, blocked_.data(), counters);
    add_cost(cost);
    std::vector<float> *const arrays[] = {
        &start_[0],  &start_[1],     &start_[2],     &p_[0],         &p_[1],
        &p_[2],      &direction_[0], &direction_[1], &direction_[2], &weight_[0],
        &weight_[1], &weight_[2],    &density_};
    uint32_t left = 0;
    for (uint32_t first = 0; first < count_; first += PACKET_WIDTH) {
        const LaneBits bright = first_lanes(count_ - first) & ~zero_bytes(&blocked_[first]);
        if (bright == 0)
            continue;
        store_compressed(&ray_[left], load<UIntPacket>(&ray_[first]), bright);
        for (std::vector<float> *array : arrays)
            store_compressed(array->data() + left, load<FloatPacket>(array->data() + first),
                             bright);
        left += uint32_t(std::popcount(bright));
    }
    count_ = left;
    counters.rays -= left; // which are counted when they are traced
}

void BsdfRays::find_hits(const TraceOptions &options, Counters &counters, float *cost) {
    const RayGroup rays = group(cost);
    const SceneData &scene = scene_.data;
    if (!scene_.any_shape_glows) {
        trace_any_unordered(*scene.tree, rays, options, blocked_.data(), counters);
        if (scene.objects)
            trace_any_objects(*scene.objects, rays, blocked_.data(), counters);
    } else {
        const HitGroup hits{scene.objects ? t_.data() : nullptr, primitive_.data()};
        trace_closest_unordered(*scene.tree, rays, options, hits, counters);
        if (scene.objects)
            trace_closest_objects(*scene.objects, rays,
                                  {hits.t, hits.primitive, instance_.data()}, counters);
    }
    add_cost(cost);
}

Vec3<FloatPacket> BsdfRays::vector(const std::vector<float> (&of)[3], size_t first) const {
    return {load<FloatPacket>(&of[0][first]), load<FloatPacket>(&of[1][first]),
            load<FloatPacket>(&of[2][first])};
}

Vec3<FloatPacket> BsdfRays::light_from_shapes(size_t first, LaneBits hits) {
    const FloatPacket zero(0.0f);
    Vec3<FloatPacket> light = in_all_lanes({});
    LaneArray<uint32_t> emitters, shape_numbers;
    emitters.fill(NONE);
    shape_numbers.fill(NONE);
    HitPacket hit;
    for_each_lane(hits, [&](uint32_t lane) {
        const uint32_t shape = scene_.shape_of_face[primitive_[first + lane]];
        emitters[lane] = scene_.data.shapes[shape].emitter;
        shape_numbers[lane] = shape;
        hit.lanes |= LaneBits(emitters[lane] != NONE) << lane;
    });
    if (hit.lanes == 0)
        return light;
    hit.origin = vector(start_, first);
    hit.direction = vector(direction_, first);
    hit.faces = load<UIntPacket>(&primitive_[first]);
    if (scene_.data.objects) {
        hit.t = load<FloatPacket>(&t_[first]);
        hit.instances = load<UIntPacket>(&instance_[first]);
    }
    const SurfacePoint<FloatPacket> point = surface_of(scene_, faces_, hit, false);
    const Vec3<FloatPacket> from = vector(p_, first);
    const UIntPacket shapes = load<UIntPacket>(shape_numbers);
    const FloatPacket own =
        load<FloatPacket>(&density_[first]) * FloatPacket(shares_.bsdfs);
    const LaneBits bright =
        hit.lanes & to_bits(dot(hit.direction, point.shading_normal) < zero);
    for_each_value(
        load<UIntPacket>(emitters), bright, [&](uint32_t emitter, LaneBits lanes) {
            const Emission emission = emission_of(
                scene_, emitter,
                {hit.origin, hit.direction, hit.faces, shapes, hit.t, hit.instances},
                lanes);
            const FloatPacket other =
                area_density(scene_, emitter,
                             {from, point.p, point.shading_normal, emission.density}) *
                FloatPacket(shares_.emitters);
            const FloatPacket weight = power_heuristic(own, other);
            const auto mask = from_bits<FloatPacket>(lanes);
            for (int k = 0; k < 3; ++k)
                light[k] = select(mask, weight * emission.radiance[k], light[k]);
        });
    return light;
}

Vec3<FloatPacket> BsdfRays::light_from_around(size_t first, LaneBits misses) const {
    const Vec3<FloatPacket> direction = vector(direction_, first);
    const FloatPacket own =
        load<FloatPacket>(&density_[first]) * FloatPacket(shares_.bsdfs);
    const FloatPacket other =
        environment_density(scene_, direction) * FloatPacket(shares_.emitters);
    const auto mask = from_bits<FloatPacket>(misses);
    const FloatPacket weight = select(mask, power_heuristic(own, other), FloatPacket(0.0f));
    const Vec3<FloatPacket> radiance = scene_.environment.radiance(direction);
    Vec3<FloatPacket> light;
    for (int k = 0; k < 3; ++k)
        light[k] = select(mask, weight * radiance[k], FloatPacket(0.0f));
    return light;
}

void BsdfRays::trace(const TraceOptions &options, Counters &counters, float *cost,
                     std::span<float *const, 3> colours) {
    if (count_ > 0)
        leave_out_dark(options, counters, cost);
    if (count_ == 0)
        return;
    find_hits(options, counters, cost);
    for (size_t first = 0; first < count_; first += PACKET_WIDTH) {
        const LaneBits lanes = first_lanes(count_ - uint32_t(first));
        const LaneBits misses =
            lanes &
            (scene_.any_shape_glows
                 ? to_bits(load<UIntPacket>(&primitive_[first]) == UIntPacket(NO_PRIMITIVE))
                 : zero_bytes(&blocked_[first]));
        Vec3<FloatPacket> light = in_all_lanes({});
        if (scene_.any_shape_glows && misses != lanes)
            light = light_from_shapes(first, lanes & ~misses);
        if (scene_.environment.exists() && misses != 0)
            light = light + light_from_around(first, misses);
        const FloatPacket weight(shares_.bsdf_weight);
        for (int k = 0; k < 3; ++k) {
            const LaneArray<float> brought =
                to_lanes<float>(load<FloatPacket>(&weight_[k][first]) * light[k] * weight);
            for_each_lane(lanes, [&](uint32_t lane) {
                colours[size_t(k)][ray_[first + lane]] += brought[lane];
            });
        }
    }
}

} // namespace mlrt
