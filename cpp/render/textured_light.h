// Area lights whose radiance is a texture, on rectangles and analytic shapes.
#pragma once

#include "render/surface.h"
#include "render/textured_material.h"

#include <cstdint>

namespace mlrt {

// A point that an emitter sample chooses on such a light.
template <typename Real>
struct LightPoint {
    Vec3<Real> p, normal, radiance; // the normal is unit, on the glowing side
    Real density;                   // per area; 0: no light
};

// Mitsuba 3.9's area.cpp, sample_direction, and eval_parameterization of rectangle.cpp,
// sphere.cpp, disk.cpp and cylinder.cpp: a point of the texture, and where it lies on the
// shape. Spheres and cylinders that are turned Mitsuba meets elsewhere.
LightPoint<float> sample_textured_light(const PreparedScene &scene, uint32_t emitter,
                                        float x, float y);
LightPoint<FloatPacket> sample_textured_light(const PreparedScene &scene, uint32_t emitter,
                                              const FloatPacket &x, const FloatPacket &y);

// What any area light emits where the given lanes meet it, of which there must be one, and
// how densely emitter samples of it lie there, per area; any values in other lanes.
struct Emission {
    Vec3<FloatPacket> radiance;
    FloatPacket density;
};
Emission emission_of(const PreparedScene &scene, uint32_t emitter, const ShadedRays &rays,
                     LaneBits lanes);

} // namespace mlrt
