// What becomes of a reference that a plane cuts.
#pragma once

#include "geometry/clip.h"
#include "kdtree/reference.h"

namespace mlrt {

// Bounds of both parts, either of which may be empty. Without clipping to the triangle:
// those of the reference on both sides.
inline ClippedHalves parts_of(const Reference &reference, const Triangle &triangle,
                              const Box3f &cell, const SplitPlane &plane, bool clip) {
    ClippedHalves parts;
    if (clip) {
        parts = clip_to_halves(triangle, cell, plane.axis, plane.position);
    } else {
        parts = {cell, cell};
        parts.lower.hi[plane.axis] = parts.upper.lo[plane.axis] = plane.position;
    }
    // Also within what was known before: bounds only ever shrink.
    for (Box3f *part : {&parts.lower, &parts.upper}) {
        for (int k = 0; k < 3; ++k) {
            part->lo[k] = std::max(part->lo[k], reference.bounds.lo[k]);
            part->hi[k] = std::min(part->hi[k], reference.bounds.hi[k]);
        }
        if (part->empty())
            *part = {};
    }
    return parts;
}

} // namespace mlrt
