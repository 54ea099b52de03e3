#include "render/emitter_density.h"

#include "render/analytic_emitter.h"
#include "render/shadow_offset.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlrt {

namespace {

// Of the choice of an emitter.
float probability(const PreparedScene &scene, uint32_t emitter) {
    if (scene.emitter_choice.empty())
        return 1.0f / float(scene.data.emitters.size());
    return scene.data.emitters[emitter].sampling_weight *
           scene.emitter_choice.normalization();
}

// Over the cone that the sphere fills, or, from inside, over its area.
FloatPacket sphere_density(const AnalyticShape &sphere, const FloatPacket &by_area,
                           const Vec3<FloatPacket> &from) {
    // The largest number below 1.
    constexpr float ALMOST_ONE = 1 - 0x1p-24f;
    const FloatPacket zero(0.0f), one(1.0f);
    const Vec3<FloatPacket> way = in_all_lanes(Vec3f(sphere.frame.origin)) - from;
    const FloatPacket sine =
        FloatPacket(float(sphere.radius)) * (one / square_root(dot(way, way)));
    const FloatPacket cosine = square_root(maximum(one - sine * sine, zero));
    const FloatPacket by_cone = FloatPacket(0.5f * std::numbers::inv_pi_v<float>) /
                                cone_opening(cosine, sine * sine);
    return select(sine < FloatPacket(ALMOST_ONE), by_cone, by_area);
}

} // namespace

bool emitters_can_be_hit(const PreparedScene &scene) {
    return scene.any_shape_glows || scene.environment.exists();
}

FloatPacket area_density(const PreparedScene &scene, uint32_t emitter,
                         const LightHits &hits) {
    const FloatPacket zero(0.0f);
    const Vec3<FloatPacket> way = hits.p - hits.from;
    const FloatPacket squared = dot(way, way);
    const FloatPacket cosine =
        dot(way * (FloatPacket(1.0f) / square_root(squared)), hits.normal);
    FloatPacket density = hits.by_area * (squared / -cosine);
    const Emitter &light = scene.data.emitters[emitter];
    const AnalyticShape *analytic = scene.analytic(scene.data.shapes[light.shape]);
    // A texture is sampled by its points.
    if (analytic && analytic->type == AnalyticType::sphere &&
        light.radiance_texture == NONE)
        density = sphere_density(*analytic, density, hits.from);
    return select(cosine < zero, density * FloatPacket(probability(scene, emitter)), zero);
}

FloatPacket environment_density(const PreparedScene &scene,
                                const Vec3<FloatPacket> &direction) {
    const std::vector<Emitter> &emitters = scene.data.emitters;
    const auto found = std::find_if(emitters.begin(), emitters.end(), [](const Emitter &e) {
        return is_environment(e.type);
    });
    return scene.environment.density(direction) *
           FloatPacket(probability(scene, uint32_t(found - emitters.begin())));
}

FloatPacket power_heuristic(const FloatPacket &density, const FloatPacket &other) {
    const FloatPacket zero(0.0f), one(1.0f);
    // Not a number only if both are infinite.
    const FloatPacket ratio = maximum(other / density, zero);
    return select(density > zero, one / fused(ratio, ratio, one), zero);
}

} // namespace mlrt
