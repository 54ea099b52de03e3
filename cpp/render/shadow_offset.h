// Where rays that leave a surface begin, and where shadow rays end: every epsilon of the
// renderer.
#pragma once

#include "base/vec.h"

#include <cmath>

namespace mlrt {

// Mitsuba 3.9's core/math.h; its Epsilon is 2^-24. Later versions bound the error instead.
inline constexpr float RAY_EPSILON = 1500 * 0x1p-24f;
// The share of its length that a shadow ray stops short of its target.
inline constexpr float SHADOW_EPSILON = 10 * RAY_EPSILON;

// A point off the surface, on the side that `towards` points to (Mitsuba's interaction.h).
// The normal is the geometric one and has unit length.
inline Vec3f offset_point(Vec3f p, Vec3f normal, Vec3f towards) {
    const float size = (1.0f + max_component(abs(p))) * RAY_EPSILON;
    const float signed_size = std::copysign(size, dot(normal, towards));
    return {std::fma(signed_size, normal.x, p.x), std::fma(signed_size, normal.y, p.y),
            std::fma(signed_size, normal.z, p.z)};
}

} // namespace mlrt
