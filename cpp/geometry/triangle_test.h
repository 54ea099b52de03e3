// One ray against one triangle: the contract that every traversal keeps.
//
// A ray {o + t d} hits the closed triangle (a, b, c) if and only if the exact values of
//     U = det(d, b - o, c - o),  V = det(d, c - o, a - o),  W = det(d, a - o, b - o)
// are all >= 0 or all <= 0 and not all zero. All zero means a ray in the triangle's plane,
// or a triangle without area: a miss. Since U, V and W are signed volumes over the edges
// (Pluecker coordinates, as in Davidovic, Engelhardt, Georgiev, Slusallek, Dachsbacher
// 2012), and the sign of an edge's volume is the same for both triangles that share it, no
// ray passes between them.
//
// The distance is t = n.(a - o) / n.d with n = (b - a) x (c - a), evaluated to 2^-30 and
// rounded to float once. A hit counts if t_min < t <= t_max, and of several the one with
// the least t wins, of equal ones the one with the lowest number.
//
// Signs are exact whatever the order of evaluation, so kernels may filter them in any way;
// the formula of t is written once, here, for scalars and packets.
#pragma once

#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle.h"

#include <cstdint>

namespace mlrt {

// Unit roundoff of double.
inline constexpr double DOUBLE_ROUNDOFF = 0x1p-53;

// How far the decision of a ray had to go.
enum class Precision : uint32_t { filtered, exact };

struct HitDecision {
    bool hit;
    Precision precision;
};

// Decides by the signs above: in double with a forward error bound, and exactly where that
// leaves a sign open. Any finite input is allowed.
HitDecision decide_hit(Vec3f origin, Vec3f direction, const Triangle &triangle);

// Sum over the components of the error bound of a cross product of differences, |a| x |b|:
// what multiplies the roundoff in the bounds below.
template <typename Real>
Vec3<Real> cross_magnitude(const Vec3<Real> &a, const Vec3<Real> &b) {
    return {absolute(a.y) * absolute(b.z) + absolute(a.z) * absolute(b.y),
            absolute(a.z) * absolute(b.x) + absolute(a.x) * absolute(b.z),
            absolute(a.x) * absolute(b.y) + absolute(a.y) * absolute(b.x)};
}

// The plane of a triangle, n.(x - a) = 0, and the magnitude that bounds the error of n.
struct TrianglePlane {
    Vec3d normal;    // (b - a) x (c - a), not normalised
    Vec3d magnitude; // |b - a| x |c - a| with absolute components

    explicit TrianglePlane(const Triangle &triangle) {
        const Vec3d a(triangle.a);
        const Vec3d ab = Vec3d(triangle.b) - a;
        const Vec3d ac = Vec3d(triangle.c) - a;
        normal = cross(ab, ac);
        magnitude = cross_magnitude(ab, ac);
    }
};

// Numerator n.(a - o) of the distance, and whether it is good to 2^-31.
template <typename Real>
struct PlaneNumerator {
    Real value;
    Real error;

    PlaneNumerator(const TrianglePlane &plane, const Vec3<Real> &to_vertex) {
        value = (plane.normal.x * to_vertex.x + plane.normal.y * to_vertex.y) +
                plane.normal.z * to_vertex.z;
        // Eight roundings in a row lead to the value (gamma_8); 10 covers those of the
        // bound.
        error = (10 * DOUBLE_ROUNDOFF) * ((plane.magnitude.x * absolute(to_vertex.x) +
                                           plane.magnitude.y * absolute(to_vertex.y)) +
                                          plane.magnitude.z * absolute(to_vertex.z));
    }
};

// t in double, and whether its relative error is known to be below 2^-30. Where it is not,
// the caller takes exact_distance(): the choice depends on the ray and the triangle alone,
// so that all kernels make it alike.
//
// max_direction is the greatest absolute component of the direction. The numerator may be
// shared by all lanes (rays with a common origin) or have one value for each.
template <typename Real>
struct PlaneDistance {
    Real t;
    MaskOf<Real> accurate;

    template <typename Numerator>
    PlaneDistance(const TrianglePlane &plane, const PlaneNumerator<Numerator> &numerator,
                  const Vec3<Real> &direction, const Real &max_direction) {
        const Real denominator =
            (plane.normal.x * direction.x + plane.normal.y * direction.y) +
            plane.normal.z * direction.z;
        const double magnitude =
            (10 * DOUBLE_ROUNDOFF) *
            ((plane.magnitude.x + plane.magnitude.y) + plane.magnitude.z);
        const Real denominator_error = magnitude * max_direction;
        t = Real(numerator.value) / denominator;
        accurate = MaskOf<Real>(numerator.error <= 0x1p-31 * absolute(numerator.value)) &
                   (denominator_error <= 0x1p-31 * absolute(denominator));
    }
};

// t by exact numerator and denominator. Only for rays and triangles that decide_hit()
// accepts.
double exact_distance(Vec3f origin, Vec3f direction, const Triangle &triangle);

// t of a ray that decide_hit() accepts, rounded to float.
float hit_distance(Vec3f origin, Vec3f direction, const Triangle &triangle);

// Weights of the vertices b and c at the hit point of a ray that decide_hit() accepts
// (Mitsuba's prim_uv), in [0, 1] and with u + v <= 1.
Vec2f barycentrics(Vec3f origin, Vec3f direction, const Triangle &triangle);

} // namespace mlrt
