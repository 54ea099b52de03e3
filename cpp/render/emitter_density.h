// How likely emitter samples are to lie where a ray has met a light, for sixteen rays side
// by side.
#pragma once

#include "base/simd.h"
#include "render/prepared_scene.h"

#include <cstdint>

namespace mlrt {

// Whether a ray can meet an emitter of the scene.
bool emitters_can_be_hit(const PreparedScene &scene);

// Points on one area light, with the normal there, seen from points `from`, and how densely
// its samples lie there by area.
struct LightHits {
    const Vec3<FloatPacket> &from, &p, &normal;
    const FloatPacket &by_area;
};

// The density per solid angle at `from`, the choice of the emitter included; 0 where the
// light is seen from behind (Mitsuba 3.9's scene.cpp, pdf_emitter_direction, and area.cpp,
// shape.cpp and sphere.cpp, pdf_direction).
FloatPacket area_density(const PreparedScene &scene, uint32_t emitter,
                         const LightHits &hits);

// The same for the emitter all around the scene, which must exist, in directions of unit
// length.
FloatPacket environment_density(const PreparedScene &scene,
                                const Vec3<FloatPacket> &direction);

// Weight of a sample that could also have been taken with another density (Veach 1997,
// section 9.2.4, exponent 2); 0 if neither is positive. An infinite density of its own is
// that of a sample which cannot.
FloatPacket power_heuristic(const FloatPacket &density, const FloatPacket &other);

} // namespace mlrt
