#include "render/tile.h"

#include "objects/trace_objects.h"
#include "render/emitter_density.h"
#include "render/emitter_sampling.h"
#include "render/textured_light.h"

#include <algorithm>
#include <array>
#include <new>
#include <numbers>

namespace mlrt {

TileRenderer::TileRenderer(const PreparedScene &scene, const SampleStreams &streams,
                           const Sampling &sampling, const RayOptions &options,
                           ShadowOffset offset, TileTarget target)
    : scene_(scene), streams_(streams),
      // One is as good as many where the numbers make no difference.
      emitter_samples_(needs_light_numbers(scene) ? sampling.emitter_samples
                                                  : std::min(1u, sampling.emitter_samples)),
      options_(options), offset_(offset), target_(target),
      faces_(scene, scene.plane.origin),
      samples_(scene, streams, sampling.sampler, target.film.sampled(),
               {target.film.needs_positions(),
                needs_light_numbers(scene) ? sampling.emitter_samples : 0,
                emitters_can_be_hit(scene) ? sampling.bsdf_samples : 0}),
      shares_(sampling.emitter_samples, sampling.bsdf_samples),
      bsdf_samples_(emitters_can_be_hit(scene) ? sampling.bsdf_samples : 0) {
    for (uint32_t emitter = 0; emitter < scene.data.emitters.size(); ++emitter) {
        shadows_.emplace_back(scene, emitter, offset);
        // Mitsuba 3.9's direct.cpp does not divide light that comes from one direction by
        // the number of samples.
        const float shared_by =
            has_one_direction(scene.data.emitters[emitter].type)
                ? float(emitter_samples_) / float(sampling.emitter_samples)
                : float(emitter_samples_);
        factors_.push_back(std::numbers::inv_pi_v<float> / shared_by);
        factors_differ_ |= factors_.back() != factors_.front();
    }
    plain_ = shades_plainly();
    if (bsdf_samples_ > 0)
        bsdf_rays_.emplace(scene, shares_);
    for (ShadedPacket &packet : packets_)
        packet.hit.origin = in_all_lanes(scene.plane.origin);
}

void TileRenderer::render(const PixelGroup &group) {
    samples_.generate(group);
    make_room();
    trace_camera_rays(group);
    if (scene_.environment.exists() && !scene_.data.hide_emitters)
        add_background();
    shade_hits();
    pass_hidden_emitters();
    add_reflected_light();
    write(group);
}

void TileRenderer::make_room() {
    const size_t padded = samples_.padded_count();
    t_.resize(padded);
    primitive_.resize(padded);
    std::fill(primitive_.begin() + ptrdiff_t(samples_.count()), primitive_.end(),
              NO_PRIMITIVE);
    if (scene_.data.objects)
        instance_.resize(padded, NO_INSTANCE);
    values_.resize(target_.channels.count);
    for (AlignedVector<float> &channel : values_)
        channel.assign(padded, 0.0f);
    if (target_.cost)
        cost_.assign(padded, 0.0f);
    reflected_.clear();
    for (ShadowRays &shadow : shadows_)
        shadow.clear();
    if (bsdf_rays_)
        bsdf_rays_->clear();
}

void TileRenderer::trace_camera_rays(const PixelGroup &group) {
    RayGroup rays;
    rays.count = uint32_t(samples_.count());
    rays.has_common_origin = scene_.plane.has_common_origin();
    rays.common_origin = scene_.plane.origin;
    for (int k = 0; k < 3; ++k) {
        rays.origin[k] = samples_.origin(k);
        rays.direction[k] = samples_.direction(k);
    }
    rays.t_min = IntervalEnds::of_all(scene_.plane.near_clip);
    rays.t_max = IntervalEnds::of_all(scene_.plane.far_clip);
    rays.cost = target_.cost ? cost_.data() : nullptr;

    const PixelRect &sampled = target_.film.sampled();
    const int x = sampled.x + int(group.left), y = sampled.y + int(group.top);
    CameraTile tile;
    tile.camera = scene_.plane.single;
    tile.x = uint32_t(x);
    tile.y = uint32_t(y);
    tile.size = group.side;
    tile.samples = group.sample_count;
    const bool is_square = rays.has_common_origin && group.side > 0 && x >= 0 && y >= 0;
    const bool wants_distances = target_.channels.depth >= 0 || scene_.data.objects;
    trace(rays, is_square ? &tile : nullptr, wants_distances ? t_.data() : nullptr,
          primitive_.data(), instance_.data());
}

// Instances are written only if the scene has objects, and distances are needed then.
void TileRenderer::trace(const RayGroup &rays, const CameraTile *tile, float *t,
                         uint32_t *primitive, uint32_t *instance) {
    const TraceOptions &options =
        rays.has_common_origin ? options_.together : options_.alone;
    trace_closest(*scene_.data.tree, rays, options, HitGroup{t, primitive},
                  counters_.primary, tile);
    if (scene_.data.objects)
        trace_closest_objects(*scene_.data.objects, rays, {t, primitive, instance},
                              counters_.primary);
}

// What rays see that meet nothing.
void TileRenderer::add_background() {
    for (size_t first = 0; first < samples_.count(); first += PACKET_WIDTH) {
        const LaneBits misses =
            to_bits(load<UIntPacket>(&primitive_[first]) == UIntPacket(NO_PRIMITIVE));
        if (misses == 0)
            continue;
        const auto mask = from_bits<FloatPacket>(misses);
        const Vec3<FloatPacket> light =
            scene_.environment.radiance(samples_.directions(first));
        for (int k = 0; k < 3; ++k)
            store(&values_[size_t(k)][first], select(mask, light[k], FloatPacket(0.0f)));
    }
}

// Packets take each step of shading one after the other: a step is a chain of operations
// that wait for each other, of which a processor works on several only if they are short.
void TileRenderer::shade_hits() {
    const bool common_origin = scene_.plane.has_common_origin();
    const size_t at_once = AT_ONCE * PACKET_WIDTH;
    for (size_t begin = 0; begin < samples_.count(); begin += at_once) {
        const size_t end = std::min(begin + at_once, samples_.count());
        size_t count = 0;
        for (size_t first = begin; first < end; first += PACKET_WIDTH) {
            const auto faces = load<UIntPacket>(&primitive_[first]);
            const LaneBits hits = to_bits(faces != UIntPacket(NO_PRIMITIVE));
            if (hits == 0 || (plain_ && find_plain_packet(first, faces, hits)))
                continue;
            ShadedPacket &packet = packets_[count];
            HitPacket &hit = packet.hit;
            hit.faces = faces;
            hit.lanes = hits;
            ++count;
            hit.ray = UIntPacket(uint32_t(first)) + lane_indices();
            hit.direction = samples_.directions(first);
            for (int k = 0; k < 3 && !common_origin; ++k)
                hit.origin[k] = load<FloatPacket>(samples_.origin(k) + first);
            hit.first = first;
            if (scene_.data.objects) {
                hit.t = load<FloatPacket>(&t_[first]);
                hit.instances = load<UIntPacket>(&instance_[first]);
            }
            // Made in place: an assignment would copy it.
            new (&packet.point)
                SurfacePoint<FloatPacket>(surface_of(scene_, faces_, hit, common_origin));
        }
        shade_plain_packets();
        const std::span packets = std::span(packets_).first(count);
        for (const ShadedPacket &packet : packets)
            write_depth_and_normal(packet.hit, packet.point, *packet.hit.first);
        shade(packets);
    }
}

void TileRenderer::write_depth_and_normal(const HitPacket &hit,
                                          const SurfacePoint<FloatPacket> &point,
                                          size_t first) {
    const ChannelNumbers &channels = target_.channels;
    const auto hits = from_bits<FloatPacket>(hit.lanes);
    const auto set = [&](int channel, const FloatPacket &value) {
        store(&values_[size_t(channel)][first], select(hits, value, FloatPacket(0.0f)));
    };
    // Mitsuba's distance: from the near plane, along the normalised direction.
    if (channels.depth >= 0)
        set(channels.depth,
            (load<FloatPacket>(&t_[first]) - FloatPacket(scene_.plane.near_clip)) *
                length(hit.direction));
    for (int k = 0; k < 3 && channels.normal >= 0; ++k)
        set(channels.normal + k, point.shading_normal[k]);
}

// Adds what surfaces emit towards the camera. Returns the lanes to be shaded; those that
// met an emitter which is to be hidden go on behind it instead.
LaneBits TileRenderer::add_emission(const HitPacket &hit,
                                    const SurfacePoint<FloatPacket> &point,
                                    const UIntPacket &shapes, LaneBits seen_from_front) {
    const LaneBits maybe = hit.lanes & scene_.glowing_faces.lanes_of(hit.faces);
    if (maybe == 0)
        return hit.lanes;
    LaneBits hidden = 0;
    const LaneArray<uint32_t> rays = to_lanes<uint32_t>(hit.ray);
    for_each_value(shapes, maybe, [&](uint32_t shape, LaneBits holders) {
        const uint32_t number = scene_.data.shapes[shape].emitter;
        if (number == NONE)
            return;
        if (scene_.data.hide_emitters) {
            hidden |= holders;
            return;
        }
        const LaneBits lit = holders & seen_from_front;
        if (lit == 0)
            return;
        const Vec3<FloatPacket> radiance =
            emission_of(
                scene_, number,
                {hit.origin, hit.direction, hit.faces, shapes, hit.t, hit.instances}, lit)
                .radiance;
        for_each_lane(lit, [&](uint32_t lane) {
            for (int k = 0; k < 3; ++k)
                values_[size_t(k)][rays[lane]] += radiance[k].entry(lane);
        });
    });
    if (hidden != 0) {
        const Vec3<FloatPacket> start =
            onward_start(scene_, offset_, hit, point, hit.direction);
        for_each_lane(hidden, [&](uint32_t lane) {
            passing_.ray.push_back(rays[lane]);
            for (int k = 0; k < 3; ++k)
                passing_.origin[k].push_back(start[k].entry(lane));
        });
    }
    return hit.lanes & ~hidden;
}

void TileRenderer::add_reflected_light() {
    float *cost = target_.cost ? cost_.data() : nullptr;
    const std::array<float *, 3> colours{values_[0].data(), values_[1].data(),
                                         values_[2].data()};
    for (ShadowRays &shadow : shadows_)
        shadow.trace(scene_.data, shadow.from_light() ? options_.together : options_.alone,
                     counters_.shadow, cost, reflected_);
    reflected_.add_to(colours);
    if (bsdf_rays_)
        bsdf_rays_->trace(options_.alone, counters_.bsdf, cost, colours);
}

// Mitsuba's moment.cpp: CIE XYZ of the colours (spectrum.h, srgb_to_xyz), and the squares.
void TileRenderer::add_moments() {
    constexpr Vec3f TO_XYZ[3] = {{0.412453f, 0.357580f, 0.180423f},
                                 {0.212671f, 0.715160f, 0.072169f},
                                 {0.019334f, 0.119193f, 0.950227f}};
    const int first = target_.channels.moment;
    for (int k = 0; k < 3 && first >= 0; ++k) {
        AlignedVector<float> &mean = values_[size_t(first + k)];
        AlignedVector<float> &square = values_[size_t(first + 3 + k)];
        for (size_t ray = 0; ray < samples_.count(); ++ray) {
            mean[ray] =
                dot(TO_XYZ[k], Vec3f{values_[0][ray], values_[1][ray], values_[2][ray]});
            square[ray] = mean[ray] * mean[ray];
        }
    }
}

void TileRenderer::write(const PixelGroup &group) {
    add_moments();
    std::vector<const float *> values;
    for (const AlignedVector<float> &channel : values_)
        values.push_back(channel.data());
    target_.film.add(group, samples_.film_x(), samples_.film_y(), values.data());

    const bool wants_primitive = target_.primitive && group.first_sample == 0;
    if (!wants_primitive && !target_.cost)
        return;
    for (size_t i = 0; i < group.offsets.size(); ++i) {
        const size_t ray = i * group.sample_count;
        size_t number;
        if (!target_.film.in_crop(group.pixel(i), number))
            continue;
        if (wants_primitive)
            target_.primitive[number] = int32_t(primitive_[ray]);
        for (uint32_t k = 0; target_.cost && k < group.sample_count; ++k)
            target_.cost[number] += cost_[ray + k] / float(streams_.samples_per_pixel());
    }
}

} // namespace mlrt
