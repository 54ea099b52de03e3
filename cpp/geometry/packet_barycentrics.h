// Where rays cross triangles they are known to hit, for one ray or sixteen with a triangle
// each: the same operations in the same order, hence the same bits.
#pragma once

#include "base/simd.h"
#include "base/vec.h"

#include <type_traits>

namespace mlrt {

// The vertices of a triangle, or of one a lane.
template <typename Real>
struct Corners {
    Vec3<Real> a, b, c;
};

// Weights of the vertices b and c in double precision; zeros where they have none. What
// sixteen rays share is given once: Origin and Corner are float then, else Real. The
// results are the same.
template <typename Real, typename Origin, typename Corner>
Vec2<DoubleOf<Real>> double_barycentrics_of(const Vec3<Origin> &origin,
                                            const Vec3<Real> &direction,
                                            const Corners<Corner> &corners) {
    using Shared =
        std::conditional_t<std::is_same_v<Origin, float>, DoubleOf<Corner>, DoubleOf<Real>>;
    using Double = DoubleOf<Real>;
    const auto o = Vec3<Shared>(to_double(origin));
    const auto d = to_double(direction);
    const auto a = Vec3<Shared>(to_double(corners.a)) - o;
    const auto b = Vec3<Shared>(to_double(corners.b)) - o;
    const auto c = Vec3<Shared>(to_double(corners.c)) - o;
    // All three have one sign or are rounding noise around zero.
    const Double u = absolute(dot(d, Vec3<Double>(cross(b, c))));
    const Double v = absolute(dot(d, Vec3<Double>(cross(c, a))));
    const Double w = absolute(dot(d, Vec3<Double>(cross(a, b))));
    const Double sum = u + v + w;
    const MaskOf<Double> has_area = sum > Double(0.0);
    const Double scale = select(has_area, Double(1.0) / sum, Double(0.0));
    return {v * scale, w * scale};
}

// The same, rounded, and with a sum of at most one.
template <typename Real, typename Origin, typename Corner>
Vec2<Real> barycentrics_of(const Vec3<Origin> &origin, const Vec3<Real> &direction,
                           const Corners<Corner> &corners) {
    const auto weights = double_barycentrics_of(origin, direction, corners);
    const Real weight_b(weights.x), weight_c(weights.y);
    return {weight_b, minimum(weight_c, Real(1.0f) - weight_b)};
}

} // namespace mlrt
