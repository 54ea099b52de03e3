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
// The distance is the float nearest to t = n.(a - o) / n.d with n = (b - a) x (c - a), ties
// to even. A hit counts if t_min < t <= t_max, and of several the one with the least t
// wins, of equal ones the one with the lowest number.
//
// Neither depends on the order of evaluation, so kernels may filter both in any way.
#pragma once

#include "base/counters.h"
#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle.h"

#include <cstdint>
#include <limits>

namespace mlrt {

// Unit roundoff of float and of double.
inline constexpr float FLOAT_ROUNDOFF = 0x1p-24f;
inline constexpr double DOUBLE_ROUNDOFF = 0x1p-53;

// Twice the greatest error of rounding to a denormal float.
inline constexpr float SMALLEST_FLOAT = 0x1p-149f;

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

// The plane of a triangle, n.(x - a) = 0, and the magnitude that bounds the error of n: of
// one, or of several side by side.
template <typename Real>
struct PlaneOf {
    Vec3<Real> normal;    // (b - a) x (c - a), not normalised
    Vec3<Real> magnitude; // |b - a| x |c - a| with absolute components

    explicit PlaneOf(const Triangle &triangle)
        : PlaneOf(Vec3d(triangle.a), Vec3d(triangle.b), Vec3d(triangle.c)) {}
    PlaneOf(const Vec3<Real> &a, const Vec3<Real> &b, const Vec3<Real> &c)
        : normal(cross(b - a, c - a)), magnitude(cross_magnitude(b - a, c - a)) {}

    // n.d, and what bounds its error once it is multiplied by the greatest absolute
    // component of the direction.
    template <typename Direction>
    Direction denominator(const Vec3<Direction> &direction) const {
        return (normal.x * direction.x + normal.y * direction.y) + normal.z * direction.z;
    }
    Real denominator_error() const {
        return (10 * DOUBLE_ROUNDOFF) * ((magnitude.x + magnitude.y) + magnitude.z);
    }
};

using TrianglePlane = PlaneOf<double>;

// Numerator n.(a - o) of the distance, with a bound on its error.
template <typename Real>
struct PlaneNumerator {
    Real value;
    Real error;

    template <typename Plane>
    PlaneNumerator(const Plane &plane, const Vec3<Real> &to_vertex) {
        value = (plane.normal.x * to_vertex.x + plane.normal.y * to_vertex.y) +
                plane.normal.z * to_vertex.z;
        // Eight roundings in a row lead to the value (gamma_8); 10 covers those of the
        // bound.
        error = (10 * DOUBLE_ROUNDOFF) * ((plane.magnitude.x * absolute(to_vertex.x) +
                                           plane.magnitude.y * absolute(to_vertex.y)) +
                                          plane.magnitude.z * absolute(to_vertex.z));
    }
};

// t in double with a bound on its error. max_direction is the greatest absolute component
// of the direction. The numerator may be shared by all lanes (rays with a common origin) or
// have one value for each.
//
// With N and D exact, n and d as computed, |N - n| <= e_n and |D - d| <= e_d <= |d| / 2,
//     |N/D - n/d| <= (e_n + |n/d| e_d) / |D| <= 2 (e_n + |n/d| e_d) / |d|;
// two more roundings come from the reciprocal and the product with it.
template <typename Real>
struct PlaneDistance {
    Real t;
    Real error; // NaN or infinite if nothing is known

    // By numerator and denominator and bounds on their errors.
    PlaneDistance(const Real &numerator, const Real &numerator_error,
                  const Real &denominator, const Real &denominator_error) {
        const Real reciprocal = 1.0 / denominator;
        t = numerator * reciprocal;
        const Real absolute_t = absolute(t);
        error = 2.0 * ((numerator_error + absolute_t * denominator_error) *
                       absolute(reciprocal)) +
                (4 * DOUBLE_ROUNDOFF) * absolute_t;
        error = select(MaskOf<Real>(denominator_error <= 0.5 * absolute(denominator)),
                       error, Real(std::numeric_limits<double>::infinity()));
    }

    template <typename Plane, typename Numerator>
    PlaneDistance(const Plane &plane, const PlaneNumerator<Numerator> &numerator,
                  const Vec3<Real> &direction, const Real &max_direction)
        : PlaneDistance(Real(numerator.value), Real(numerator.error),
                        plane.denominator(direction),
                        plane.denominator_error() * max_direction) {}

    // The float nearest to t, where `certain`: both ends of the range of t round to it.
    template <typename Single>
    Single rounded() const {
        return Single(t + error);
    }
    template <typename Single>
    MaskOf<Single> certain() const {
        return Single(t - error) == Single(t + error);
    }
};

// The float nearest to t, by exact arithmetic. Only for rays and triangles that
// decide_hit() accepts.
float exact_distance(Vec3f origin, Vec3f direction, const Triangle &triangle);

// The same, by exact arithmetic only where double precision does not suffice.
float hit_distance(Vec3f origin, Vec3f direction, const Triangle &triangle,
                   Counters &counters);

// Weights of the vertices b and c at the hit point of a ray that decide_hit() accepts
// (Mitsuba's prim_uv), in [0, 1] and with u + v <= 1.
Vec2f barycentrics(Vec3f origin, Vec3f direction, const Triangle &triangle);

} // namespace mlrt
