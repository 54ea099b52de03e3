// Points of the unit disk: for one, or for sixteen side by side with the same operations
// and hence the same bits.
#pragma once

#include "base/simd.h"

#include <numbers>

namespace mlrt {

inline float sine(float a) {
    return first_lane(sine(FloatPacket(a)));
}
inline float cosine(float a) {
    return first_lane(cosine(FloatPacket(a)));
}

// Uniform if x and y are in [0, 1) (Shirley and Chiu 1997, "A low distortion map between
// disk and square", in the form of Mitsuba's warp.h).
template <typename Real>
Vec2<Real> on_disk(const Real &x, const Real &y) {
    constexpr float PI = std::numbers::pi_v<float>;
    const Real a = fused(Real(2.0f), x, Real(-1.0f));
    const Real b = fused(Real(2.0f), y, Real(-1.0f));
    const MaskOf<Real> steep = absolute(a) < absolute(b);
    const Real r = select(steep, b, a), other = select(steep, a, b);
    Real angle = Real(0.25f * PI) * other / r;
    angle = select(steep, Real(0.5f * PI) - angle, angle);
    angle = select(r == Real(0.0f), Real(0.0f), angle);
    return {r * cosine(angle), r * sine(angle)};
}

} // namespace mlrt
