// Curved shapes that rays meet as they are, without being cut into triangles: Mitsuba's
// `sphere`, `disk` and `cylinder`.
//
// A ray is met in double precision, in which the difference of its origin and a centre is
// exact unless their sizes are nine orders of magnitude apart. The distance is the float
// nearest to the computed one, and a hit counts if t_min < t <= t_max. Unlike those of
// triangles, these decisions are not exact: rays within some 2^-50 of a silhouette,
// relative to the distance of the origin, may go either way.
#pragma once

#include "base/vec.h"
#include "geometry/affine.h"

#include <cstdint>

namespace mlrt {

enum class AnalyticType : uint32_t {
    sphere,   // of radius |x axis| around the origin of its frame
    disk,     // of radius 1 around the origin of its frame, in the plane z = 0
    cylinder, // of radius 1 around the z axis of its frame, from z = 0 to 1, open
};

struct AnalyticShape {
    AnalyticType type = AnalyticType::sphere;
    Affine frame;      // from the shape's own frame to where it stands
    Affine inverse;    // of it
    double radius = 1; // sphere
    Box3f box;         // around it, widened by rounding

    AnalyticShape() = default;
    // The frame must not be singular.
    AnalyticShape(AnalyticType type, const Affine &frame);
};

// Where a line meets a shape: up to two distances, in ascending order.
struct Crossings {
    double t[2];
    int count = 0;
};

Crossings crossings_of(const AnalyticShape &shape, Vec3d origin, Vec3d direction);

// The least distance t with t_min < t <= t_max as a float, or infinity.
float nearest_crossing(const AnalyticShape &shape, Vec3d origin, Vec3d direction,
                       float t_min, float t_max);

// A point of the surface with its normal. The normal has unit
// length and points away from the centre of a sphere, along the normal of a disk, and,
// unless the frame is mirrored, away from the axis of a cylinder, as Mitsuba has it.
struct AnalyticPoint {
    Vec3d p, normal;
};

// A point that lies beside the surface by rounding, put back onto it.
AnalyticPoint point_on(const AnalyticShape &shape, Vec3d beside);

// Where a ray meets the surface, at the crossing that rounds to t.
AnalyticPoint analytic_point(const AnalyticShape &shape, Vec3d origin, Vec3d direction,
                             float t);

} // namespace mlrt
