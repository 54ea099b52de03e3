// What materials with textures reflect where rays meet them.
#pragma once

#include "base/simd.h"
#include "render/prepared_scene.h"
#include "render/surface.h"
#include "render/texture.h"

#include <array>
#include <cstdint>
#include <vector>

namespace mlrt {

// Rays, the faces that they are known to hit, and the shapes of these.
struct ShadedRays {
    const Vec3<FloatPacket> &origin, &direction;
    const UIntPacket &faces, &shapes;
    // Any values in a scene without objects.
    const FloatPacket &t;
    const UIntPacket &instances;
};

// Texture coordinates in a triangle, by those of its vertices.
Vec2f mean_coordinates(const std::vector<Vec2f> &uvs,
                       const std::array<uint32_t, 3> &vertices, Vec3f weights);

// A place on a face of the tree, by the weights of its second and third vertex.
TexturePoint texture_point(const SceneData &scene, const Shape &shape, uint32_t face,
                           float weight_b, float weight_c);

// Where the given lanes of rays meet textures.
class TexturePoints {
public:
    TexturePoints(const PreparedScene &scene, const ShadedRays &rays, LaneBits lanes);

    TexturePoint at(uint32_t lane) const;

private:
    const PreparedScene &scene_;
    const ShadedRays &rays_;
    LaneBits on_objects_;
    FaceNumbers faces_{};
    LaneArray<float> b_{}, c_{}; // weights of the second and third vertex
};

// Calls visit(lane, at) for each of the given lanes.
template <typename Visit>
void for_each_texture_point(const PreparedScene &scene, const ShadedRays &rays,
                            LaneBits lanes, Visit &&visit) {
    const TexturePoints points(scene, rays, lanes);
    for_each_lane(lanes, [&](uint32_t lane) { visit(lane, points.at(lane)); });
}

// The given lanes of `albedo`, those of shapes with a textured material replaced.
Vec3<FloatPacket> textured_albedo(const PreparedScene &scene, const ShadedRays &rays,
                                  LaneBits lanes, LaneBits seen_from_front,
                                  Vec3<FloatPacket> albedo);

// The same, with what is not reflected apart: `albedo` of the share that is, and that
// share.
void add_textures(const PreparedScene &scene, const ShadedRays &rays, LaneBits lanes,
                  LaneBits seen_from_front, Vec3<FloatPacket> &albedo,
                  FloatPacket &opacity);

} // namespace mlrt
