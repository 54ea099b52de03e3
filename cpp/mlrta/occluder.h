// Triangles that stop a beam: where all of its rays hit one, nothing behind it matters
// (Reshetov, Soupikov, Hurley 2005, section 3.2.2, "covering objects").
#pragma once

#include "geometry/triangle.h"
#include "mlrta/beam.h"

#include <optional>

namespace mlrt {

// A bound for t_max of the beam, if every ray of it is certain to hit the triangle, inside
// its edges and after the ray begins: none can have a first hit with a greater t, as
// reported, rounded to float. Nothing if that is not certain; so for beams without corners.
//
// Let d be a direction, or d / |d_k| for beams with a corner_axis k. The ray hits if
//     U = d.(b x c),  V = d.(c x a),  W = d.(a x b)
// have one strict sign, with a, b, c relative to the common origin (triangle_test.h), and
// meets the plane at N / (U + V + W), N = a.(b x c). U, V and W are linear in d, so over
// all d they are extreme at corners, but for slack.|b x c| and so on. Hence the signs at
// the corners tell those of all rays if they exceed that and the rounding error, and the
// least sum tells the greatest distance.
std::optional<double> covered_until(const Beam &beam, const Triangle &triangle);

} // namespace mlrt
