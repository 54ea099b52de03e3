#include "render/textured_material.h"

#include "render/object_texture.h"
#include "render/surface.h"
#include "render/texture.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

Vec2f mean_coordinates(const std::vector<Vec2f> &uvs,
                       const std::array<uint32_t, 3> &vertices, Vec3f weights) {
    const auto mean = [&](float Vec2f::*k) {
        const auto of = [&](size_t vertex) { return uvs[vertices[vertex]].*k; };
        return std::fma(of(2), weights.z, std::fma(of(1), weights.y, of(0) * weights.x));
    };
    return {mean(&Vec2f::x), mean(&Vec2f::y)};
}

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
    at.uv = mean_coordinates(scene.uvs, at.vertices, at.weights);
    return at;
}

TexturePoints::TexturePoints(const PreparedScene &scene, const ShadedRays &rays,
                             LaneBits lanes)
    : scene_(scene), rays_(rays), on_objects_(lanes_on_objects(scene, rays.faces, lanes)) {
    const LaneBits in_tree = lanes & ~on_objects_;
    if (in_tree == 0)
        return;
    faces_ = faces_in(rays.faces, in_tree);
    const Vec2<FloatPacket> weights =
        barycentrics_of(rays.origin, rays.direction, corners_of(scene, faces_));
    b_ = to_lanes<float>(weights.x);
    c_ = to_lanes<float>(weights.y);
}

TexturePoint TexturePoints::at(uint32_t lane) const {
    if ((on_objects_ >> lane) & 1u)
        return object_texture_point(
            scene_,
            ObjectHits{rays_.origin, rays_.direction, rays_.t, rays_.faces, rays_.instances}
                .at(lane));
    const uint32_t face = faces_[lane];
    return texture_point(scene_.data, scene_.data.shapes[scene_.shape_of_face[face]], face,
                         b_[lane], c_[lane]);
}

namespace {

Vec3f reflectance(const SceneData &scene, const Material &material, bool front,
                  const TexturePoint &at) {
    const uint32_t texture = front ? material.front_texture : material.back_texture;
    return texture != NONE ? evaluate(scene.textures, texture, at)
           : front         ? material.front
                           : material.back;
}

float opacity_of(const SceneData &scene, const Material &material, const TexturePoint &at) {
    return std::clamp(evaluate(scene.textures, material.opacity, at).x, 0.0f, 1.0f);
}

// Calls visit(lane, material, front, at) for the given lanes whose shape has a textured
// material; returns whether any has.
template <typename Visit>
bool for_each_textured_lane(const PreparedScene &scene, const ShadedRays &rays,
                            LaneBits lanes, LaneBits seen_from_front, Visit &&visit) {
    LaneBits textured = 0;
    for_each_value(rays.shapes, lanes, [&](uint32_t shape, LaneBits holders) {
        if (scene.shape_materials[shape].is_textured())
            textured |= holders;
    });
    if (textured == 0)
        return false;
    const LaneArray<uint32_t> shapes = to_lanes<uint32_t>(rays.shapes);
    for_each_texture_point(scene, rays, textured,
                           [&](uint32_t lane, const TexturePoint &at) {
                               visit(lane, scene.shape_materials[shapes[lane]],
                                     ((seen_from_front >> lane) & 1u) != 0, at);
                           });
    return true;
}

struct ColourLanes {
    LaneArray<float> of[3];

    explicit ColourLanes(const Vec3<FloatPacket> &colour)
        : of{to_lanes<float>(colour.x), to_lanes<float>(colour.y),
             to_lanes<float>(colour.z)} {}
    void set(uint32_t lane, Vec3f colour) {
        for (int k = 0; k < 3; ++k)
            of[k][lane] = colour[k];
    }
    Vec3<FloatPacket> packet() const {
        return {load<FloatPacket>(of[0]), load<FloatPacket>(of[1]),
                load<FloatPacket>(of[2])};
    }
};

} // namespace

Vec3<FloatPacket> textured_albedo(const PreparedScene &scene, const ShadedRays &rays,
                                  LaneBits lanes, LaneBits seen_from_front,
                                  Vec3<FloatPacket> albedo) {
    ColourLanes colours(albedo);
    const bool any = for_each_textured_lane(
        scene, rays, lanes, seen_from_front,
        [&](uint32_t lane, const Material &material, bool front, const TexturePoint &at) {
            Vec3f colour = reflectance(scene.data, material, front, at);
            if (material.opacity != NONE)
                colour = colour * opacity_of(scene.data, material, at);
            colours.set(lane, colour);
        });
    return any ? colours.packet() : albedo;
}

void add_textures(const PreparedScene &scene, const ShadedRays &rays, LaneBits lanes,
                  LaneBits seen_from_front, Vec3<FloatPacket> &albedo,
                  FloatPacket &opacity) {
    ColourLanes colours(albedo);
    LaneArray<float> shares = to_lanes<float>(opacity);
    const bool any = for_each_textured_lane(
        scene, rays, lanes, seen_from_front,
        [&](uint32_t lane, const Material &material, bool front, const TexturePoint &at) {
            colours.set(lane, reflectance(scene.data, material, front, at));
            if (material.opacity != NONE)
                shares[lane] = opacity_of(scene.data, material, at);
        });
    if (!any)
        return;
    albedo = colours.packet();
    opacity = load<FloatPacket>(shares);
}

} // namespace mlrt
