#include "render/textured_material.h"

#include "render/surface.h"
#include "render/texture.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

// Mitsuba's mesh.cpp: without texture coordinates the weights of the vertices b and c.
TexturePoint texture_point(const SceneData &scene, const Shape &shape, uint32_t face,
                           float weight_b, float weight_c) {
    TexturePoint at;
    at.face = face;
    at.vertices = scene.faces[face];
    at.weights = {1.0f - weight_b - weight_c, weight_b, weight_c};
    at.uv = {weight_b, weight_c};
    if (!shape.texture_coordinates)
        return at;
    const auto mean = [&](float Vec2f::*k) {
        const auto of = [&](int vertex) { return scene.uvs[at.vertices[vertex]].*k; };
        return std::fma(of(2), at.weights.z,
                        std::fma(of(1), at.weights.y, of(0) * at.weights.x));
    };
    at.uv = {mean(&Vec2f::x), mean(&Vec2f::y)};
    return at;
}

namespace {

Vec3f reflectance(const SceneData &scene, const Material &material, bool front,
                  const TexturePoint &at) {
    const uint32_t texture = front ? material.front_texture : material.back_texture;
    Vec3f colour = front ? material.front : material.back;
    if (texture != NONE)
        colour = evaluate(scene.textures, texture, at);
    if (material.opacity != NONE)
        colour = colour *
                 std::clamp(evaluate(scene.textures, material.opacity, at).x, 0.0f, 1.0f);
    return colour;
}

} // namespace

Vec3<FloatPacket> textured_albedo(const PreparedScene &scene, const ShadedRays &rays,
                                  LaneBits lanes, LaneBits seen_from_front,
                                  Vec3<FloatPacket> albedo) {
    LaneBits textured = 0;
    for_each_value(rays.shapes, lanes, [&](uint32_t shape, LaneBits holders) {
        if (scene.shape_materials[shape].is_textured())
            textured |= holders;
    });
    if (textured == 0)
        return albedo;
    const FaceNumbers numbers = faces_in(rays.faces, textured);
    const Vec2<FloatPacket> weights =
        barycentrics_of(rays.origin, rays.direction, corners_of(scene, numbers));
    const LaneArray<float> b = to_lanes<float>(weights.x), c = to_lanes<float>(weights.y);
    LaneArray<float> colours[3];
    for (int k = 0; k < 3; ++k)
        colours[k] = to_lanes<float>(albedo[k]);
    for_each_lane(textured, [&](uint32_t lane) {
        const uint32_t face = numbers[lane], shape = scene.shape_of_face[face];
        const TexturePoint at =
            texture_point(scene.data, scene.data.shapes[shape], face, b[lane], c[lane]);
        const Vec3f colour = reflectance(scene.data, scene.shape_materials[shape],
                                         ((seen_from_front >> lane) & 1u) != 0, at);
        for (int k = 0; k < 3; ++k)
            colours[k][lane] = colour[k];
    });
    for (int k = 0; k < 3; ++k)
        albedo[k] = load<FloatPacket>(colours[k]);
    return albedo;
}

} // namespace mlrt
