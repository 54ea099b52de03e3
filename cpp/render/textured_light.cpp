#include "render/textured_light.h"

namespace mlrt {

LightPoint<float> sample_textured_light(const PreparedScene &scene, uint32_t emitter,
                                        float x, float y) {
    const Emitter &light = scene.data.emitters[emitter];
    const EmitterTable &table = scene.emitter_tables[emitter];
    const TextureSampler::Sample sample = table.texture.sample(x, y);
    TexturePoint at;
    at.uv = sample.uv;
    return {light.corner + sample.uv.x * light.edge_u + sample.uv.y * light.edge_v,
            evaluate(scene.data.textures, light.radiance_texture, at),
            sample.density * table.inverse_area};
}

LightPoint<FloatPacket> sample_textured_light(const PreparedScene &scene, uint32_t emitter,
                                              const FloatPacket &x, const FloatPacket &y) {
    const LaneArray<float> xs = to_lanes<float>(x), ys = to_lanes<float>(y);
    LaneArray<float> p[3], radiance[3], density;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const LightPoint<float> one =
            sample_textured_light(scene, emitter, xs[lane], ys[lane]);
        for (int k = 0; k < 3; ++k) {
            p[k][lane] = one.p[k];
            radiance[k][lane] = one.radiance[k];
        }
        density[lane] = one.density;
    }
    LightPoint<FloatPacket> point;
    for (int k = 0; k < 3; ++k) {
        point.p[k] = load<FloatPacket>(p[k]);
        point.radiance[k] = load<FloatPacket>(radiance[k]);
    }
    point.density = load<FloatPacket>(density);
    return point;
}

Emission emission_of(const PreparedScene &scene, uint32_t emitter, const ShadedRays &rays,
                     LaneBits lanes) {
    const Emitter &light = scene.data.emitters[emitter];
    const EmitterTable &table = scene.emitter_tables[emitter];
    if (light.radiance_texture == NONE)
        return {in_all_lanes(light.radiance), FloatPacket(table.inverse_area)};
    const Shape &shape = scene.data.shapes[light.shape];
    const FaceNumbers faces = faces_in(rays.faces, lanes);
    const Vec2<FloatPacket> weights =
        barycentrics_of(rays.origin, rays.direction, corners_of(scene, faces));
    const LaneArray<float> b = to_lanes<float>(weights.x), c = to_lanes<float>(weights.y);
    LaneArray<float> radiance[3] = {}, density = {};
    for_each_lane(lanes, [&](uint32_t lane) {
        const TexturePoint at =
            texture_point(scene.data, shape, faces[lane], b[lane], c[lane]);
        const Vec3f value = evaluate(scene.data.textures, light.radiance_texture, at);
        for (int k = 0; k < 3; ++k)
            radiance[k][lane] = value[k];
        density[lane] = table.texture.density(at.uv) * table.inverse_area;
    });
    return {{load<FloatPacket>(radiance[0]), load<FloatPacket>(radiance[1]),
             load<FloatPacket>(radiance[2])},
            load<FloatPacket>(density)};
}

} // namespace mlrt
