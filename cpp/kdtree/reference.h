// A triangle in a cell.
#pragma once

#include "base/vec.h"

#include <cstdint>
#include <span>

namespace mlrt {

// A triangle and the bounds of its part in the cell.
struct Reference {
    Box3f bounds;
    uint32_t triangle;
};

// Vector code reads {lo.x, lo.y, lo.z, hi.x} and {hi.x, hi.y, hi.z, triangle} as they lie.
static_assert(sizeof(Reference) == 28);

// The references of a cell, by increasing number of the triangle, and their common bounds.
struct References {
    std::span<const Reference> list;
    Box3f bounds;

    uint64_t count() const { return list.size(); }
};

inline void add_bounds(Box3f &bounds, const Box3f &more) {
    for (int k = 0; k < 3; ++k) {
        bounds.lo[k] = std::min(bounds.lo[k], more.lo[k]);
        bounds.hi[k] = std::max(bounds.hi[k], more.hi[k]);
    }
}

// A plane {x[axis] = position}, and the child that gets what lies in it.
struct SplitPlane {
    int axis = 0;
    float position = 0;
    bool planar_below = true;
};

struct Candidate {
    SplitPlane plane;
    uint64_t lower_count = 0, upper_count = 0;
    double cost = 0; // in the units of BuildOptions
};

} // namespace mlrt
