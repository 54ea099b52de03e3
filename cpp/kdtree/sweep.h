// The planes of a cell that are worth a look, found in one pass over its sorted events.
#pragma once

#include "kdtree/events.h"
#include "kdtree/sah.h"

#include <optional>
#include <vector>

namespace mlrt {

struct Candidate {
    SplitPlane plane;
    uint64_t lower_count = 0, upper_count = 0;
    double cost = 0; // in the units of BuildOptions
};

// References that lie in a plane, which may be a face of the cell.
struct PlanarGroup {
    int axis;
    float position;
    size_t first_event; // a run of `count` planar events of that axis
    uint64_t count;
    uint64_t below, above; // references that reach below, above the plane
};

struct SweepResult {
    // The cheapest plane strictly inside the cell, if there is any. What lies in it goes to
    // the cheaper side. Among equals: the first axis, the lowest position, the lower side.
    std::optional<Candidate> best;
    std::vector<PlanarGroup> planar_groups;
};

// Tries both faces of the bounds of every reference (Wald and Havran 2006, algorithm 5).
// The cell has positive area.
void sweep(const CellContents &contents, const Box3f &cell, const BuildOptions &options,
           SweepResult &result);

} // namespace mlrt
