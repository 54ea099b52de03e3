// Shading of packets with samples of emitters: the part of a tile that leads from surfaces
// to shadow rays.
#include "render/emitter_sampling.h"
#include "render/textured_material.h"
#include "render/tile.h"

#include <new>

namespace mlrt {

namespace {

UIntPacket shapes_of(const PreparedScene &scene, const UIntPacket &faces, LaneBits lanes) {
    UIntPacket shapes(NONE);
    for_each_value(faces, lanes, [&](uint32_t face, LaneBits holders) {
        shapes = select(from_bits<UIntPacket>(holders),
                        UIntPacket(scene.shape_of_face[face]), shapes);
    });
    return shapes;
}

// What the sides that the rays see reflect; black in other lanes.
Vec3<FloatPacket> albedo_of(const PreparedScene &scene, const UIntPacket &shapes,
                            LaneBits lanes, LaneBits seen_from_front) {
    Vec3<FloatPacket> albedo = in_all_lanes({});
    const auto set = [&](LaneBits side, Vec3f colour) {
        const auto mask = from_bits<FloatPacket>(side);
        for (int k = 0; k < 3 && side != 0; ++k)
            albedo[k] = select(mask, FloatPacket(colour[k]), albedo[k]);
    };
    for_each_value(shapes, lanes, [&](uint32_t shape, LaneBits holders) {
        const Material &material = scene.shape_materials[shape];
        set(holders & seen_from_front, material.front);
        set(holders & ~seen_from_front, material.back);
    });
    return albedo;
}

} // namespace

// Mitsuba's direct.cpp, for BSDF samples see bsdf_light.cpp: light that the surface emits,
// and shadow rays for light that it reflects. A ray that contributes nothing, however its
// shadow ray fares, is left out as soon as that is known.
void TileRenderer::shade(std::span<ShadedPacket> packets) {
    for (ShadedPacket &packet : packets)
        find_reflectance(packet);
    if (bsdf_rays_ || shadows_.empty())
        return;
    for (uint32_t sample = 0; sample < emitter_samples_; ++sample) {
        for (ShadedPacket &packet : packets)
            choose_light(packet, sample);
        for (const ShadedPacket &packet : packets)
            add_emitter_sample(packet, sample);
    }
}

// Adds emission, and with BSDF samples everything.
void TileRenderer::find_reflectance(ShadedPacket &packet) {
    const HitPacket &hit = packet.hit;
    const SurfacePoint<FloatPacket> &point = packet.point;
    const FloatPacket zero(0.0f);
    // Only its sign matters, so the direction need not have unit length.
    const FloatPacket cos_view = -dot(hit.direction, point.shading_normal);
    const LaneBits seen_from_front = to_bits(cos_view > zero);
    const UIntPacket shapes = shapes_of(scene_, hit.faces, hit.lanes);

    LaneBits lanes =
        add_emission(hit, point, shapes, seen_from_front) & to_bits(cos_view != zero);
    Vec3<FloatPacket> albedo = albedo_of(scene_, shapes, lanes, seen_from_front);
    if (bsdf_rays_) {
        shade_in_both_ways(hit, point, shapes, lanes, cos_view, albedo);
        return;
    }
    if (lanes & scene_.textured_faces.lanes_of(hit.faces))
        albedo = textured_albedo(
            scene_, {hit.origin, hit.direction, hit.faces, shapes, hit.t, hit.instances},
            lanes, seen_from_front, albedo);
    packet.cos_view = cos_view;
    packet.albedo = albedo;
    packet.lanes = lanes & not_black(albedo);
}

void TileRenderer::choose_light(ShadedPacket &packet, uint32_t sample) {
    if (packet.lanes == 0)
        return;
    packet.choices = choose_emitters(scene_, of_rays(packet.hit, samples_.light_x(sample)));
    if (scene_.all_emitters_are_points) // in place, too
        new (&packet.light) EmitterSample<FloatPacket>(
            sample_chosen_points(scene_, packet.choices, packet.lanes, packet.point.p));
    else if (samples_at_once())
        sample_lights(packet, of_rays(packet.hit, samples_.light_y(sample)));
}

// Of the emitters that the lanes chose, whichever they are.
void TileRenderer::sample_lights(ShadedPacket &packet, const FloatPacket &y) {
    const EmitterChoices &choices = packet.choices;
    new (&packet.light) EmitterSample<FloatPacket>(
        light_of_chosen(choices.emitter, packet.lanes, [&](uint32_t emitter) {
            return sample_chosen(scene_, emitter, choices, packet.point.p, y);
        }));
}

void TileRenderer::add_emitter_sample(const ShadedPacket &packet, uint32_t sample) {
    const EmitterChoices &choices = packet.choices;
    if (samples_at_once()) {
        if (packet.lanes != 0)
            add_light(packet, packet.lanes, packet.light, choices.emitter);
        return;
    }
    for_each_value(choices.emitter, packet.lanes, [&](uint32_t emitter, LaneBits lit) {
        const FloatPacket y = of_rays(packet.hit, samples_.light_y(sample));
        add_light(packet, lit, sample_chosen(scene_, emitter, choices, packet.point.p, y),
                  choices.emitter);
    });
}

// Of the emitters that the given lanes chose: mostly the same for all there are.
FloatPacket TileRenderer::factors_of(const UIntPacket &emitters, LaneBits lanes) const {
    FloatPacket factors(factors_[0]);
    if (!factors_differ_)
        return factors;
    for_each_value(emitters, lanes, [&](uint32_t emitter, LaneBits holders) {
        factors = select(from_bits<FloatPacket>(holders), FloatPacket(factors_[emitter]),
                         factors);
    });
    return factors;
}

// Of the emitters that the lanes chose. With robust offsets several must all be points.
void TileRenderer::add_light(const ShadedPacket &packet, LaneBits lanes,
                             const EmitterSample<FloatPacket> &light,
                             const UIntPacket &emitters) {
    const HitPacket &hit = packet.hit;
    const SurfacePoint<FloatPacket> &point = packet.point;
    const FloatPacket zero(0.0f), cosine = dot(light.direction, point.shading_normal);
    const FloatPacket cos_light = select(packet.cos_view > zero, cosine, -cosine);
    lanes &= not_black(light.weight) & to_bits(cos_light > zero);
    if (lanes == 0)
        return;
    const FloatPacket share = factors_of(emitters, lanes) * cos_light;
    const Vec3<FloatPacket> reflected = (packet.albedo * share) * light.weight;
    const uint32_t number = reflected_.add(hit, reflected);
    const auto append = [&](uint32_t emitter, LaneBits lit,
                            const ShadowSegment<FloatPacket> &segment) {
        shadows_[emitter].append(lit, number, segment.start, segment.target);
    };
    if (offset_ == ShadowOffset::mitsuba) {
        const ShadowSegment<FloatPacket> segment = mitsuba_segment(point, light);
        for_each_value(emitters, lanes, [&](uint32_t emitter, LaneBits lit) {
            append(emitter, lit, segment);
        });
        return;
    }
    for_each_value(emitters, lanes, [&](uint32_t emitter, LaneBits lit) {
        append(emitter, lit, shadow_segment(scene_, offset_, hit, point, emitter, light));
    });
}

} // namespace mlrt
