// Directions that materials choose, for sixteen hits side by side.
#pragma once

#include "base/simd.h"
#include "render/hit_packet.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

namespace mlrt {

// What surfaces do with light: what the side that a ray sees reflects, in all directions
// alike, and the share of light that is reflected at all. The rest goes straight through.
struct Scattering {
    Vec3<FloatPacket> albedo;
    FloatPacket opacity;
    LaneBits delta = 0;             // lanes of materials that no light sample is taken of
    LaneBits mirrors = 0;           // lanes with a mirror or glass
    LaneArray<uint32_t> specular{}; // which one, of those: in SceneData::speculars
};

// Of the given lanes; `albedo` is that of materials without textures.
Scattering scattering_of(const PreparedScene &scene, const HitPacket &hit,
                         const UIntPacket &shapes, LaneBits lanes, LaneBits seen_from_front,
                         const Vec3<FloatPacket> &albedo);

struct BsdfSamples {
    LaneBits lanes = 0;          // that light may come from
    Vec3<FloatPacket> direction; // unit, but for those that go on as they came
    Vec3<FloatPacket> weight;    // of the light that arrives from there
    FloatPacket density; // per solid angle; infinity where there is one direction only
};

// x, y and part are uniform in [0, 1); the same numbers give the same samples in Mitsuba
// (3.9's diffuse.cpp, twosided.cpp, mask.cpp and null.cpp; see specular.h). cos_view:
// cosine of the angle between the shading normal and the way back to the ray's origin, up
// to a factor.
BsdfSamples sample_bsdf(const PreparedScene &scene, const HitPacket &hit,
                        const SurfacePoint<FloatPacket> &point, LaneBits lanes,
                        const FloatPacket &cos_view, const Scattering &scattering,
                        const FloatPacket &x, const FloatPacket &y,
                        const FloatPacket &part);

} // namespace mlrt
