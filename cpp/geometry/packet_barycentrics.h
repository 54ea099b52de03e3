// Where rays cross triangles they are known to hit, for one ray or sixteen with a triangle
// each: the operations of barycentrics() in triangle_test.h in the same order, hence the
// same bits.
#pragma once

#include "base/simd.h"
#include "base/vec.h"

namespace mlrt {

// The vertices of a triangle, or of one a lane.
template <typename Real>
struct Corners {
    Vec3<Real> a, b, c;
};

// Weights of the vertices b and c in double precision; zeros where they have none.
template <typename Real>
Vec2<DoubleOf<Real>> double_barycentrics_of(const Vec3<Real> &origin,
                                            const Vec3<Real> &direction,
                                            const Corners<Real> &corners) {
    const auto o = to_double(origin), d = to_double(direction);
    const auto a = to_double(corners.a) - o;
    const auto b = to_double(corners.b) - o;
    const auto c = to_double(corners.c) - o;
    // All three have one sign or are rounding noise around zero.
    const auto u = absolute(dot(d, cross(b, c)));
    const auto v = absolute(dot(d, cross(c, a)));
    const auto w = absolute(dot(d, cross(a, b)));
    const auto sum = u + v + w;
    using Double = DoubleOf<Real>;
    const auto has_area = sum > 0.0;
    return {select(has_area, v / sum, Double(0.0)), select(has_area, w / sum, Double(0.0))};
}

// The same, rounded, and with a sum of at most one.
template <typename Real>
Vec2<Real> barycentrics_of(const Vec3<Real> &origin, const Vec3<Real> &direction,
                           const Corners<Real> &corners) {
    const auto weights = double_barycentrics_of(origin, direction, corners);
    const Real weight_b(weights.x), weight_c(weights.y);
    return {weight_b, minimum(weight_c, Real(1.0f) - weight_b)};
}

} // namespace mlrt
