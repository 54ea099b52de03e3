// Where rays that leave a surface begin, and where shadow rays end: every epsilon of the
// renderer, in two ways.
//
// `mitsuba` is the formula of Mitsuba up to 3.9, for images that can be compared. It moves
// a point by 9e-5 (1 + its largest coordinate), whatever the size of the scene: shadows of
// a scene much smaller than 1 vanish. Versions after 3.9 bound errors instead (mitsuba3,
// pull request 1962) and will need a formula of their own here.
//
// `robust` moves a point by a bound on what rounding has done to it. The idea is Pharr,
// Jakob and Humphreys, Physically Based Rendering, 4th ed. (2023), section 6.8.6 "Robust
// spawned ray origins", OffsetRayOrigin(); what is bounded differs, because here every
// decision whether a ray of single precision hits a triangle is exact:
//
// Let u = 2^-24 be half the distance of 1 to the next number; N the unit normal of a
// triangle's plane; P a point in that plane but for an error |P_k - P*_k| <= e_k; S the
// point from or to which a ray goes; and let S = fl(P + s N), which adds at most u |S_k| to
// the error of each component. S lies on the side of the plane to which +N points if
//     N.(S - P*) >= s - sum_k |N_k| (e_k + u |S_k|) > 0,
// hence for s = (1 + slack) sum_k |N_k| (e_k + u |P_k|): the errors of N, computed in
// double precision, and of s itself, and the part of |S_k| that is due to s, are of
// relative size u or less, far below the slack. A ray between two points on the same side
// of a plane does not meet it, whatever the angle, and cannot hit the triangles in it. Its
// interval needs no epsilon but one for distances being rounded: what lies behind the far
// end, at t > 1, may come out as t = 1.
//
// What is left are the errors e_k.
//
// A hit is interpolated anew in double precision, P = a + v (b - a) + w (c - a). Any v and
// w of [0, 1] give a point of the plane; eleven roundings of values up to 2 M_k, with M_k =
// max(|a_k|, |b_k|, |c_k|), leave e_k <= 2^-49 M_k. In single precision it would be 5 u
// M_k, which is much where the triangle is large.
//
// A point on an emitter has been interpolated in single precision, but is put back into the
// plane of its face in double precision, P = Q - N (N.(Q - a)): nine roundings of values up
// to 3 M_k, for which 2^-49 M_k is enough too. That takes it along the plane by no more
// than it was wrong. A rectangle, whose vertices are rounded, need not be flat; how far it
// lies off the plane of its first face is measured.
//
// The far end of a ray is not quite where it should be: its direction d = fl(S' - S) is off
// by u |d_k|, which adds to the e_k of that end.
//
// Points of analytic shapes and of instances have errors of their own, see
// render/object_surface.h.
//
// Where numbers become denormal, rounding errors are not relative but up to 2^-150.
#pragma once

#include "base/simd.h"
#include "base/vec.h"

#include <cstdint>

namespace mlrt {

enum class ShadowOffset : uint32_t { mitsuba, robust };

// Mitsuba 3.9's core/math.h; its Epsilon is 2^-24.
inline constexpr float RAY_EPSILON = 1500 * 0x1p-24f;
// The share of its length that a shadow ray of Mitsuba stops short of its target.
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

// u of the derivation above.
inline constexpr double ROUNDING = 0x1p-24;
// e_k / M_k of points in double precision.
inline constexpr double PLANE_ERROR = 0x1p-49;
// The end of a robust shadow ray. It is also short of a light without surface, which the
// ray's direction may overshoot by u: (1 - 2u) (1 + u) < 1.
inline constexpr float BEFORE_TARGET = 1 - 0x1p-23f;

// S of the derivation above: a point in single precision that lies strictly on the side of
// a plane that `towards` points to. The point is in the plane up to `error`; the normal has
// unit length, or is zero for a point in no plane, which is then rounded only.
template <typename Real, typename Double>
Vec3<Real> point_beside_plane(const Vec3<Double> &p, const Vec3<Double> &normal,
                              const Vec3<Double> &error, const Vec3<Double> &towards) {
    const Double slack(1.001), rounding(ROUNDING), denormal(0x1p-149);
    Double size(0.0);
    for (int k = 0; k < 3; ++k)
        size =
            size + absolute(normal[k]) * (error[k] + absolute(p[k]) * rounding + denormal);
    const Double signed_size = copy_sign(size * slack, dot(normal, towards));
    return {Real(p.x + signed_size * normal.x), Real(p.y + signed_size * normal.y),
            Real(p.z + signed_size * normal.z)};
}

} // namespace mlrt
