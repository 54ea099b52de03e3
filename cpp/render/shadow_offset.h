// Where rays that leave a surface begin, and where shadow rays end: every epsilon of the
// renderer.
#pragma once

#include "base/simd.h"
#include "base/vec.h"

namespace mlrt {

// Mitsuba 3.9's core/math.h; its Epsilon is 2^-24. Later versions bound the error instead.
inline constexpr float RAY_EPSILON = 1500 * 0x1p-24f;
// The share of its length that a shadow ray stops short of its target.
inline constexpr float SHADOW_EPSILON = 10 * RAY_EPSILON;

// A point off the surface, on the side that `towards` points to (Mitsuba's interaction.h).
// The normal is the geometric one and has unit length.
template <typename Real>
Vec3<Real> offset_point(const Vec3<Real> &p, const Vec3<Real> &normal,
                        const Vec3<Real> &towards) {
    const Real largest = maximum(absolute(p.x), maximum(absolute(p.y), absolute(p.z)));
    const Real size = (Real(1.0f) + largest) * Real(RAY_EPSILON);
    const Real signed_size = copy_sign(size, dot(normal, towards));
    return {fused(signed_size, normal.x, p.x), fused(signed_size, normal.y, p.y),
            fused(signed_size, normal.z, p.z)};
}

} // namespace mlrt
