// The volume between two boxes (Haines, Wallace 1991, "Shaft Culling for Efficient
// Ray-Cast Radiosity"): what line segments from one box to the other may meet.
#pragma once

#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle.h"

namespace mlrt {

// The convex hull of two boxes that hold where segments begin and where they end. What is
// said of it allows for the roundings of saying it, in double precision.
class Shaft {
public:
    // Neither box is empty, and their coordinates and those of what is asked about are at
    // most `reach` in size, 2^126 at most.
    Shaft(const Box3f &begin, const Box3f &end, float reach);

    const Box3f &bounds() const { return bounds_; }

    // Whether a part of bounds() certainly has no point in common with the hull.
    bool misses(const Box3f &box) const;

    // Whether a triangle certainly has none, or lies in a plane that has both boxes
    // strictly on one side.
    bool misses(const Triangle &triangle) const;

private:
    bool is_beside_plane(const Triangle &triangle) const;

    Box3f begin_, end_, bounds_; // bounds of both
    double reach_;
    // Planes that bound the hull, parallel to one axis each, which touch edges of both
    // boxes. Outside where normal.x > offset; the offsets have room for roundings.
    Vec3<DoubleBlock> normal_;
    DoubleBlock offset_;
};

} // namespace mlrt
