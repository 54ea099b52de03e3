#include "render/bsdf_sampling.h"

#include "render/shading_frame.h"
#include "render/textured_material.h"
#include "render/unit_disk.h"

#include <cmath>
#include <numbers>

namespace mlrt {

Scattering scattering_of(const PreparedScene &scene, const HitPacket &hit,
                         const UIntPacket &shapes, LaneBits lanes, LaneBits seen_from_front,
                         const Vec3<FloatPacket> &albedo) {
    Scattering scattering{albedo, FloatPacket(1.0f)};
    for_each_value(shapes, lanes, [&](uint32_t shape, LaneBits holders) {
        if (scene.shape_materials[shape].passes)
            scattering.opacity = select(from_bits<FloatPacket>(holders), FloatPacket(0.0f),
                                        scattering.opacity);
    });
    if (scene.any_material_is_textured)
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
    if (bright == 0)
        return samples;
    const ShadingFrame frame = shading_frame(scene, hit, point);
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
