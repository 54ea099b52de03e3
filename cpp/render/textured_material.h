// What materials with textures reflect where rays meet them.
#pragma once

#include "base/simd.h"
#include "render/prepared_scene.h"

#include <cstdint>

namespace mlrt {

// Rays, the faces that they are known to hit, and the shapes of these.
struct ShadedRays {
    const Vec3<FloatPacket> &origin, &direction;
    const UIntPacket &faces, &shapes;
};

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
