// Choosing a light and a point on it as seen from points of the scene: for one point, or
// for sixteen side by side with the same operations and hence the same bits.
#pragma once

#include "base/simd.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

#include <cstdint>

namespace mlrt {

template <typename Real>
struct EmitterSample {
    Vec3<Real> weight;    // unoccluded radiance over probability density; 0: no light here
    Vec3<Real> direction; // unit, towards the light; any value if there is none
    Vec3<Real> target;    // where the shadow ray ends; any value if there is none
    FacesOf<Real> target_face; // where it lies on, but for rounding; NONE: on none. Of a
                               // rectangle the first, whose plane is that of all
};

struct OneEmitterSample : EmitterSample<float> {
    uint32_t emitter = NONE;
};

// Sixteen samples, each of its own emitter.
struct EmitterSamples : EmitterSample<FloatPacket> {
    LaneArray<uint32_t> emitter;
};

// Light that arrives at p. x and y are uniform in [0, 1); the same numbers give the same
// sample in Mitsuba.
OneEmitterSample sample_emitter(const PreparedScene &scene, Vec3f p, float x, float y);

// Lanes that are not asked for get any sample. The scene must have an emitter.
EmitterSamples sample_emitter(const PreparedScene &scene, const Vec3<FloatPacket> &p,
                              const FloatPacket &x, const FloatPacket &y, LaneBits lanes);

} // namespace mlrt
