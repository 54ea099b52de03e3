// Intervals of the ray parameter t that rounding never makes too short.
//
// Invariant of every traversal here: if a ray has a hit with exact parameter t in a cell,
// then near <= t (1 - 3u) and t (1 + 3u) <= far for the interval that the cell is visited
// with, where u = 2^-24. The reported distance is t rounded to float, within u t of it, so
// a cell may be left out as soon as its near end exceeds a reported distance: no hit in it
// can be nearer, or equally near.
//
// The parameter of a split plane is (s - o) * (1 / d), widened by SLACK = 8u on the safe
// side: a difference, a division and two products, each rounded once, hence a relative
// error below 4.01 u, which leaves more than the margin above.
#pragma once

#include "base/exactness.h"
#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle_test.h"

#include <limits>

namespace mlrt {

inline constexpr float SLACK = EXACT ? 0x1p-21f : 0.0f;
inline constexpr float WIDEN_FAR = 1 + SLACK;
inline constexpr float WIDEN_NEAR = 1 - SLACK;

// Below this a parameter may have lost accuracy to underflow: nothing is concluded from it.
inline constexpr float TINY_PARAMETER = 0x1p-100f;

inline constexpr float INFINITE = std::numeric_limits<float>::infinity();

// The latest distance that may be rounded to t, but for the margin of the invariant: a
// denormal t is off by more than that share. No parameter beyond it is of interest once
// there is a hit at t.
template <typename Real>
Real latest_distance(Real t) {
    return t + SMALLEST_FLOAT;
}

template <typename Real>
struct ParameterInterval {
    Real near, far;

    MaskOf<Real> not_empty() const { return near <= far; }
};

// The part of an interval that lies in a slab lo <= x <= hi, given its two faces relative
// to the origin. A ray in a face, or a direction that is too small to divide by, gives NaN
// for that face: such a slab does not shorten the interval.
template <typename Real, typename Distance>
ParameterInterval<Real> clip_to_slab(const ParameterInterval<Real> &interval,
                                     const Distance &to_lo, const Distance &to_hi,
                                     const Real &reciprocal) {
    const Real at_lo = to_lo * reciprocal;
    const Real at_hi = to_hi * reciprocal;
    const auto ordered = (at_lo <= at_hi) | (at_lo >= at_hi);
    const Real enter = minimum(at_lo, at_hi) * WIDEN_NEAR - TINY_PARAMETER;
    const Real leave = maximum(at_lo, at_hi) * WIDEN_FAR + TINY_PARAMETER;
    return {select(MaskOf<Real>(ordered & (enter > interval.near)), enter, interval.near),
            select(MaskOf<Real>(ordered & (leave < interval.far)), leave, interval.far)};
}

// How an interval is divided by a split plane: the side of the plane that the ray starts on
// is left at `parameter` for the other side, if the plane lies ahead of the ray. If it is
// behind the ray only the side of the origin is visited. If the origin is in the plane, or
// the parameter says nothing for another reason, both sides are visited with the whole
// interval.
template <typename Real>
struct DividedInterval {
    ParameterInterval<Real> origin_side, other_side;

    DividedInterval(const ParameterInterval<Real> &interval, const Real &parameter) {
        const auto ahead = parameter > TINY_PARAMETER;
        const auto behind = parameter < -TINY_PARAMETER;
        const Real leave = parameter * WIDEN_FAR;
        const Real enter = parameter * WIDEN_NEAR;
        origin_side.near = interval.near;
        origin_side.far =
            select(MaskOf<Real>(ahead & (leave < interval.far)), leave, interval.far);
        other_side.near =
            select(MaskOf<Real>(ahead & (enter > interval.near)), enter, interval.near);
        other_side.near = select(MaskOf<Real>(behind), Real(INFINITE), other_side.near);
        other_side.far = interval.far;
    }
};

} // namespace mlrt
