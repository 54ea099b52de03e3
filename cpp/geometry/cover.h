// Whether triangles in a plane cover a rectangle of it.
#pragma once

#include "base/vec.h"

#include <array>
#include <span>
#include <vector>

namespace mlrt {

using Vec2d = Vec2<double>;
using Triangle2 = std::array<Vec2d, 3>;

struct Rectangle {
    Vec2d lo, hi;
};

inline double area(const Rectangle &r) {
    return (r.hi.x - r.lo.x) * (r.hi.y - r.lo.y);
}

// Area of the part of the triangle in the rectangle, to double precision.
double area_within(const Triangle2 &triangle, const Rectangle &rectangle);

// Area of the rectangle that no triangle covers, to double precision. Stops with what it
// has found once that is more than `enough`. Where a great many triangles overlap the
// answer may be too large, never too small.
double uncovered_area(const Rectangle &rectangle, std::span<const Triangle2> triangles,
                      double enough);

} // namespace mlrt
