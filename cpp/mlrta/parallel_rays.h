// Rays with a common direction, but for rounding: those to a light that is infinitely far.
#pragma once

#include "traverse/ray_group.h"

namespace mlrt {

// Coordinates relative to a beam, of the scene and of origins, do not overflow on the way
// to anything that is computed of them if they are less.
inline constexpr float LARGEST_PARALLEL_REACH = 0x1p40f;

// Slopes of a beam's rays along its main axis differ by no more; chosen. As Mitsuba finds
// the direction to a directional light, from a point off the surface to one out of the
// scene, they differ by up to that share of the scene that the point is off.
inline constexpr float LARGEST_SLOPE_DEVIATION = 0x1p-12f;

// The same of rays taken from all over a group: beams of rays that deviate more would be
// cut to pieces; chosen.
inline constexpr float LARGEST_GROUP_DEVIATION = 0x1p-13f;

// Whether some of the active rays, taken from all over the group, have a common direction,
// and each its own origin: beams may be made of them, which set apart what deviates.
bool are_parallel(const RayGroup &rays);

} // namespace mlrt
