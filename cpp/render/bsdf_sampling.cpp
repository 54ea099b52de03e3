#include "render/bsdf_sampling.h"

#include "render/shading_frame.h"
#include "render/specular.h"
#include "render/textured_material.h"
#include "render/unit_disk.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace mlrt {

namespace {

// The mirrors and glasses of the given lanes, with the colours of their textures.
class SpecularLanes {
public:
    SpecularLanes(const PreparedScene &scene, const HitPacket &hit, LaneBits lanes,
                  const Scattering &scattering)
        : of_scene_(scene.data.speculars), numbers_(scattering.specular) {
        for_each_lane(lanes, [&](uint32_t lane) {
            textured_ |= LaneBits(of_scene_[numbers_[lane]].is_textured()) << lane;
        });
        if (textured_ == 0)
            return;
        const std::vector<Texture> &textures = scene.data.textures;
        for_each_texture_point(
            scene, {hit.origin, hit.direction, hit.faces, hit.faces, hit.t, hit.instances},
            textured_, [&](uint32_t lane, const TexturePoint &at) {
                Specular &own = own_[lane];
                own = of_scene_[numbers_[lane]];
                if (own.reflectance_texture != NONE)
                    own.reflectance = evaluate(textures, own.reflectance_texture, at);
                if (own.transmittance_texture != NONE)
                    own.transmittance = evaluate(textures, own.transmittance_texture, at);
            });
    }

    const Specular &at(uint32_t lane) const {
        return (textured_ >> lane) & 1u ? own_[lane] : of_scene_[numbers_[lane]];
    }

private:
    const std::vector<Specular> &of_scene_;
    const LaneArray<uint32_t> &numbers_;
    LaneBits textured_ = 0;
    std::array<Specular, PACKET_WIDTH> own_{};
};

// Samples of mirrors and glass in the given lanes.
void add_specular(const PreparedScene &scene, const HitPacket &hit,
                  const ShadingFrame &frame, LaneBits lanes, const Scattering &scattering,
                  const FloatPacket &part, BsdfSamples &samples) {
    const Vec3<FloatPacket> back =
        hit.direction * (FloatPacket(-1.0f) / length(hit.direction));
    const LaneArray<float> x = to_lanes<float>(dot(back, frame.s));
    const LaneArray<float> y = to_lanes<float>(dot(back, frame.t));
    const LaneArray<float> z = to_lanes<float>(dot(back, frame.n));
    // What chose to reflect at all is uniform again.
    const LaneArray<float> choice = to_lanes<float>(part / scattering.opacity);
    LaneArray<float> local[3] = {}, weight[3] = {};
    const SpecularLanes speculars(scene, hit, lanes, scattering);
    for_each_lane(lanes, [&](uint32_t lane) {
        const SpecularSample sample =
            sample_specular(speculars.at(lane), {x[lane], y[lane], z[lane]}, choice[lane]);
        for (int k = 0; k < 3; ++k) {
            local[k][lane] = sample.direction[k];
            weight[k][lane] = sample.weight[k];
        }
    });
    const Vec3<FloatPacket> away =
        frame.to_world({load<FloatPacket>(local[0]), load<FloatPacket>(local[1]),
                        load<FloatPacket>(local[2])});
    const auto mask = from_bits<FloatPacket>(lanes);
    for (int k = 0; k < 3; ++k) {
        samples.direction[k] = select(mask, away[k], samples.direction[k]);
        samples.weight[k] = select(mask, load<FloatPacket>(weight[k]), samples.weight[k]);
    }
    samples.lanes |= lanes & not_black(samples.weight);
}

} // namespace

Scattering scattering_of(const PreparedScene &scene, const HitPacket &hit,
                         const UIntPacket &shapes, LaneBits lanes, LaneBits seen_from_front,
                         const Vec3<FloatPacket> &albedo) {
    Scattering scattering{albedo, FloatPacket(1.0f)};
    for_each_value(shapes, lanes, [&](uint32_t shape, LaneBits holders) {
        const Material &material = scene.shape_materials[shape];
        if (material.passes)
            scattering.opacity = select(from_bits<FloatPacket>(holders), FloatPacket(0.0f),
                                        scattering.opacity);
        if (material.delta)
            scattering.delta |= holders;
        for (const bool front : {true, false}) {
            const uint32_t specular =
                front ? material.front_specular : material.back_specular;
            if (specular == NONE)
                continue;
            const LaneBits side = holders & (front ? seen_from_front : ~seen_from_front);
            scattering.mirrors |= side;
            for_each_lane(side,
                          [&](uint32_t lane) { scattering.specular[lane] = specular; });
        }
    });
    if (lanes & scene.textured_faces.lanes_of(hit.faces))
        add_textures(scene,
                     {hit.origin, hit.direction, hit.faces, shapes, hit.t, hit.instances},
                     lanes, seen_from_front, scattering.albedo, scattering.opacity);
    return scattering;
}

BsdfSamples sample_bsdf(const PreparedScene &scene, const HitPacket &hit,
                        const SurfacePoint<FloatPacket> &point, LaneBits lanes,
                        const FloatPacket &cos_view, const Scattering &scattering,
                        const FloatPacket &x, const FloatPacket &y,
                        const FloatPacket &part) {
    const FloatPacket zero(0.0f), one(1.0f);
    const Vec3<FloatPacket> &albedo = scattering.albedo;
    // In proportion to the cosine, on the side that the ray sees.
    const auto [u, v] = on_disk(x, y);
    const FloatPacket cosine = square_root(maximum(one - (u * u + v * v), zero));
    const LaneBits reflected = lanes & to_bits(part < scattering.opacity);
    const LaneBits bright =
        reflected & not_black(albedo) & to_bits((cosine > zero) & (cos_view != zero));
    BsdfSamples samples;
    samples.lanes = bright | (lanes & ~reflected);
    samples.direction = hit.direction;
    samples.weight = in_all_lanes({1, 1, 1});
    samples.density = FloatPacket(INFINITY);
    const LaneBits mirrored = reflected & scattering.mirrors & to_bits(cos_view != zero);
    if ((bright | mirrored) == 0)
        return samples;
    const ShadingFrame frame = shading_frame(scene, hit, point);
    if (mirrored != 0)
        add_specular(scene, hit, frame, mirrored, scattering, part, samples);
    if (bright == 0)
        return samples;
    const Vec3<FloatPacket> away = frame.to_world({u, v, copy_sign(cosine, cos_view)});
    const auto mask = from_bits<FloatPacket>(bright);
    for (int k = 0; k < 3; ++k) {
        samples.direction[k] = select(mask, away[k], samples.direction[k]);
        samples.weight[k] = select(mask, albedo[k], samples.weight[k]);
    }
    samples.density = select(
        mask, scattering.opacity * cosine * FloatPacket(std::numbers::inv_pi_v<float>),
        samples.density);
    return samples;
}

} // namespace mlrt
