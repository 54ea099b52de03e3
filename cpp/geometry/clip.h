// The part of a triangle that lies in a box, as bounds.
#pragma once

#include "base/vec.h"
#include "geometry/triangle.h"

namespace mlrt {

Box3f bounds_of(const Triangle &triangle);

// Bounds of the intersection of a closed triangle with a closed cell, both of finite
// coordinates. They contain the exact intersection and lie in the cell; if the exact
// intersection is not empty, be it a single point, neither are they. They exceed the exact
// bounds by no more than rounding, so a triangle that misses the cell by a few rounding
// errors of double precision may also be given bounds.
Box3f clip_triangle(const Triangle &triangle, const Box3f &cell);

// The same for both parts of a cell that the plane {x[axis] = position} cuts in two.
struct ClippedHalves {
    Box3f lower, upper;
};
ClippedHalves clip_to_halves(const Triangle &triangle, const Box3f &cell, int axis,
                             float position);

} // namespace mlrt
