// Shading where materials choose directions too: the part of a tile that scenes without
// BSDF samples never enter.
#include "render/emitter_density.h"
#include "render/emitter_sampling.h"
#include "render/tile.h"

#include <numbers>

namespace mlrt {

// Mitsuba's direct.cpp: samples of the emitters, then of the material, each weighed by how
// likely it was the other's.
void TileRenderer::shade_in_both_ways(const HitPacket &hit,
                                      const SurfacePoint<FloatPacket> &point,
                                      const UIntPacket &shapes, LaneBits lanes,
                                      const FloatPacket &cos_view,
                                      const Vec3<FloatPacket> &albedo) {
    const FloatPacket zero(0.0f);
    const LaneBits seen_from_front = to_bits(cos_view > zero);
    const Scattering scattering =
        scattering_of(scene_, hit, shapes, lanes, seen_from_front, albedo);
    const LaneBits reflecting =
        lanes & not_black(scattering.albedo) & to_bits(scattering.opacity > zero);
    for (uint32_t sample = 0; sample < emitter_samples_ && reflecting != 0; ++sample)
        add_weighted_sample(hit, point, reflecting, cos_view, scattering, sample);
    for (uint32_t sample = 0; sample < bsdf_samples_; ++sample) {
        FloatPacket part = of_rays(hit, samples_.bsdf_part(sample));
        if (scattering.delta != 0)
            part = select(from_bits<FloatPacket>(scattering.delta),
                          of_rays(hit, samples_.delta_part(sample)), part);
        const BsdfSamples samples =
            sample_bsdf(scene_, hit, point, lanes, cos_view, scattering,
                        of_rays(hit, samples_.bsdf_x(sample)),
                        of_rays(hit, samples_.bsdf_y(sample)), part);
        if (samples.lanes != 0)
            bsdf_rays_->append(samples, hit.ray,
                               onward_start(scene_, offset_, hit, point, samples.direction),
                               point.p);
    }
}

// As add_emitter_sample, with the power heuristic.
void TileRenderer::add_weighted_sample(const HitPacket &hit,
                                       const SurfacePoint<FloatPacket> &point,
                                       LaneBits lanes, const FloatPacket &cos_view,
                                       const Scattering &scattering, uint32_t sample) {
    const FloatPacket zero(0.0f), y = of_rays(hit, samples_.light_y(sample));
    const FloatPacket by_material =
        scattering.opacity * FloatPacket(shares_.bsdfs * std::numbers::inv_pi_v<float>);
    const EmitterChoices choices =
        choose_emitters(scene_, of_rays(hit, samples_.light_x(sample)));
    for_each_value(choices.emitter, lanes, [&](uint32_t emitter, LaneBits lit) {
        FloatPacket density;
        const EmitterSample<FloatPacket> light =
            sample_chosen(scene_, emitter, choices, point.p, y, &density);
        const FloatPacket cosine = dot(light.direction, point.shading_normal);
        const FloatPacket cos_light = select(cos_view > zero, cosine, -cosine);
        lit &= not_black(light.weight) & to_bits(cos_light > zero);
        if (lit == 0)
            return;
        const FloatPacket share = power_heuristic(density * FloatPacket(shares_.emitters),
                                                  by_material * cos_light) *
                                  scattering.opacity * FloatPacket(factors_[emitter]) *
                                  cos_light;
        const ShadowSegment<FloatPacket> segment =
            shadow_segment(scene_, offset_, hit, point, emitter, light);
        shadows_[emitter].append(
            lit, reflected_.add(hit, (scattering.albedo * share) * light.weight),
            segment.start, segment.target);
    });
}

} // namespace mlrt
