// Light from points of surfaces that glow: of one, or of sixteen side by side.
#pragma once

#include "base/simd.h"

#include <cmath>

namespace mlrt {

// What arrives at p from a point that was chosen with a density by area.
template <typename Real>
struct AreaLightSample {
    Vec3<Real> direction; // unit, towards the light; no number if p is on it
    Real density;         // by solid angle at p
    MaskOf<Real> has_light;
};

// `normal` is unit, on the side that glows.
template <typename Real>
[[gnu::always_inline]] inline AreaLightSample<Real>
sample_area_light(const Vec3<Real> &point, const Vec3<Real> &normal, const Real &by_area,
                  const Vec3<Real> &p) {
    const Real zero(0.0f);
    const Vec3<Real> to_light = point - p;
    const Real squared = dot(to_light, to_light);
    const Vec3<Real> direction = to_light * (Real(1.0f) / square_root(squared));
    const Real cosine = dot(direction, normal);
    const Real density = by_area * (squared / -cosine);
    const MaskOf<Real> has_light =
        (cosine < zero) & (density > zero) & (density < Real(INFINITY));
    return {direction, density, has_light};
}

} // namespace mlrt
