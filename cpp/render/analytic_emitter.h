// Points on analytic shapes that glow, as seen from points of the scene: for one point, or
// for sixteen side by side with the same operations and hence the same bits.
//
// The same numbers give the same points in Mitsuba (3.9's sphere.cpp, disk.cpp and
// cylinder.cpp, warp.h and frame.h), which is why all is in single precision.
#pragma once

#include "base/simd.h"
#include "geometry/analytic_shape.h"
#include "render/shadow_offset.h"
#include "render/unit_disk.h"

#include <numbers>

namespace mlrt {

// The normal is the one that the shape has without flip_normals. Of a sphere, the density
// is by solid angle; of others it is to be made from their area.
template <typename Real>
struct AnalyticSample {
    Vec3<Real> p, normal;
    Real density{};
};

template <typename Real>
Vec3<Real> spread(Vec3f v) {
    return {Real(v.x), Real(v.y), Real(v.z)};
}

template <typename Real>
Real safe_root(const Real &a) {
    return square_root(maximum(a, Real(0.0f)));
}

// From a frame whose third axis is n to the world (Duff et al., "Building an orthonormal
// basis, revisited", JCGT 6, 2017).
template <typename Real>
Vec3<Real> from_frame(const Vec3<Real> &n, const Vec3<Real> &v) {
    const Real sign = copy_sign(Real(1.0f), n.z);
    const Real a = Real(-1.0f) / (sign + n.z);
    const Real b = n.x * n.y * a;
    const Vec3<Real> s{n.x * n.x * a * sign + Real(1.0f), b * sign, -(n.x * sign)};
    const Vec3<Real> t{b, fused(n.y, n.y * a, sign), -n.y};
    Vec3<Real> result;
    for (int k = 0; k < 3; ++k)
        result[k] = fused(n[k], v.z, fused(t[k], v.y, s[k] * v.x));
    return result;
}

// 1 minus the cosine of a cone. Where that closes in single precision, and Mitsuba finds no
// light in it, half the square of the sine.
template <typename Real>
Real cone_opening(const Real &cosine, const Real &sine_squared) {
    const Real opening = Real(1.0f) - cosine;
    return select(opening > Real(0.0f), opening, Real(0.5f) * sine_squared);
}

// Uniform over the cone that the sphere fills, as seen from a point p outside of it
// (Akalin, "Sampling the visible sphere", 2013); over the whole sphere for one inside.
template <typename Real>
AnalyticSample<Real> sample_sphere(const AnalyticShape &sphere, bool flipped,
                                   float inverse_area, const Vec3<Real> &p, const Real &x,
                                   const Real &y) {
    constexpr float TWO_PI = 2 * std::numbers::pi_v<float>;
    constexpr float SMALL_ANGLE = 0.00068523f; // sin^2 of 1.5 degrees: a series from there
    const Real zero(0.0f), one(1.0f), two_pi(TWO_PI);
    const Vec3<Real> centre = spread<Real>(Vec3f(sphere.frame.origin));
    const Real radius(float(sphere.radius));
    const float edge = float(sphere.radius) * (flipped ? 1 + RAY_EPSILON : 1 - RAY_EPSILON);

    const Vec3<Real> to_centre = centre - p;
    const Real squared = dot(to_centre, to_centre);
    const MaskOf<Real> outside = squared > Real(edge * edge);
    const Real inverse_distance = one / square_root(squared);
    const Real sine_max = radius * inverse_distance;
    const Real sine_max_2 = sine_max * sine_max;
    const Real inverse_sine_max = one / sine_max;
    const Real cosine_max = safe_root(one - sine_max_2);
    const Real cosine_here = fused(cosine_max - one, x, one);
    const Real sine_2 = select(sine_max_2 > Real(SMALL_ANGLE),
                               one - cosine_here * cosine_here, sine_max_2 * x);
    const Real cosine_1 = safe_root(one - sine_2);
    // The angle at the centre of the sphere.
    const Real cosine_alpha =
        sine_2 * inverse_sine_max +
        cosine_1 * safe_root(fused(-sine_2, inverse_sine_max * inverse_sine_max, one));
    const Real sine_alpha = safe_root(fused(-cosine_alpha, cosine_alpha, one));
    const Real phi = y * two_pi;
    const Vec3<Real> in_frame{cosine(phi) * sine_alpha, sine(phi) * sine_alpha,
                              cosine_alpha};
    const Vec3<Real> seen = from_frame(-inverse_distance * to_centre, in_frame);

    const Real z = fused(Real(-2.0f), y, one);
    const Real r = safe_root(fused(-z, z, one));
    const Real angle = two_pi * x;
    const Vec3<Real> anywhere{r * cosine(angle), r * sine(angle), z};

    AnalyticSample<Real> sample;
    for (int k = 0; k < 3; ++k) {
        sample.normal[k] = select(outside, seen[k], anywhere[k]);
        sample.p[k] = fused(sample.normal[k], radius, centre[k]);
    }
    const Vec3<Real> way = sample.p - p;
    const Real way_2 = dot(way, way);
    const Real distance = square_root(way_2);
    const Real cosine_there = absolute(dot(way * (one / distance), sample.normal));
    const Real by_area = Real(inverse_area) * way_2 / cosine_there;
    const Real by_cone = select(
        distance > zero, Real(1 / TWO_PI) / cone_opening(cosine_max, sine_max_2), zero);
    sample.density = select(outside, by_cone, by_area);
    return sample;
}

// Uniform over its area.
template <typename Real>
AnalyticSample<Real> sample_disk(const AnalyticShape &disk, Vec3f normal, const Real &x,
                                 const Real &y) {
    const auto [u, v] = on_disk(x, y);
    AnalyticSample<Real> sample;
    const Vec3f origin(disk.frame.origin), x_axis(disk.frame.axes[0]),
        y_axis(disk.frame.axes[1]);
    for (int k = 0; k < 3; ++k)
        sample.p[k] = fused(Real(x_axis[k]), u, fused(Real(y_axis[k]), v, Real(origin[k])));
    sample.normal = spread<Real>(normal);
    return sample;
}

// Uniform over its area, if its frame does not shear.
template <typename Real>
AnalyticSample<Real> sample_cylinder(const AnalyticShape &cylinder, const Real &x,
                                     const Real &y) {
    const Real angle = Real(2 * std::numbers::pi_v<float>) * y;
    const Real c = cosine(angle), s = sine(angle);
    const Vec3f origin(cylinder.frame.origin);
    Vec3f axes[3];
    for (size_t k = 0; k < 3; ++k)
        axes[k] = Vec3f(cylinder.frame.axes[k]);
    AnalyticSample<Real> sample;
    for (int k = 0; k < 3; ++k) {
        sample.p[k] =
            fused(Real(axes[0][k]), c,
                  fused(Real(axes[1][k]), s, fused(Real(axes[2][k]), x, Real(origin[k]))));
        // Normals are mapped by the transpose of the inverse.
        const Vec3d column = cylinder.inverse.axes[size_t(k)];
        sample.normal[k] = Real(float(column.x)) * c + Real(float(column.y)) * s;
    }
    sample.normal = normalize(sample.normal);
    return sample;
}

} // namespace mlrt
