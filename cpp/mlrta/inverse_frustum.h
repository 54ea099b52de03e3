// Inverse frustum culling: instead of testing a cell against the planes of a frustum, ask
// where the beam crosses the planes of the cell (Reshetov, Soupikov, Hurley 2005,
// section 3.2.1).
//
// Both steps only ever say what no ray of the beam can do. "May" and "both" mean that it
// could not be excluded.
#pragma once

#include "mlrta/beam.h"

namespace mlrt {

// Children of an inner node that rays of a beam may enter. Near is the child on the side of
// the plane that the rays start on; if they start on both sides, or in the plane, it is
// always both.
enum class Cull { near_only, far_only, both };

struct AxisPlane {
    int axis;
    double position;
};

// Step 1, at an inner node with the given cell.
Cull cull_children(const Beam &beam, const Box3f &cell, AxisPlane plane);

// Whether the upper child is the near one; meaningful unless cull_children() says `both`
// because the rays start on both sides.
inline bool upper_is_near(const Beam &beam, AxisPlane plane) {
    return beam.origin[plane.axis].lo > plane.position;
}

// Step 2, at a leaf: whether a ray of the beam may pass through its cell.

// Mode P (the paper): compares, for each pair of axes, when the beam as a whole has entered
// the one slab and left the other. Ends are intervals over the beam, not values of a ray.
bool may_enter_by_parameters(const Beam &beam, const Box3f &cell);

// Mode S: the same question through slopes, where the beam leaves one slab has it reached
// the other? Tighter, because a slope keeps the correlation of d_j and d_k that mode P
// loses.
bool may_enter_by_slopes(const Beam &beam, const Box3f &cell);

} // namespace mlrt
