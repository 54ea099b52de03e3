// Choosing a light and a point on it as seen from a point of the scene.
#pragma once

#include "render/prepared_scene.h"

#include <cstdint>

namespace mlrt {

struct EmitterSample {
    Vec3f weight{};    // unoccluded radiance over probability density; 0: no light here
    Vec3f direction{}; // unit, towards the light
    Vec3f target{};    // where the shadow ray ends
    uint32_t emitter = NONE;
};

// Light that arrives at p. x and y are uniform in [0, 1); the same numbers give the same
// sample in Mitsuba.
EmitterSample sample_emitter(const PreparedScene &scene, Vec3f p, float x, float y);

} // namespace mlrt
