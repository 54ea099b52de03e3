// The planes of a cell that are worth a look, found in one pass over its sorted events.
#pragma once

#include "kdtree/events.h"
#include "kdtree/sah.h"

#include <optional>
#include <span>
#include <vector>

namespace mlrt {

// References that lie in a plane, which may be a face of the cell: a run of planar events.
struct PlanarEvents {
    int axis;
    float position;
    size_t first_event;
    uint64_t count;
    uint64_t below, above; // references that reach below, above the plane
};

// The cheapest plane so far; `axis` is -1 if there is none.
struct BestPlane {
    double cost = std::numeric_limits<double>::infinity();
    SplitPlane plane{.axis = -1};
    uint64_t lower_count = 0, upper_count = 0;

    std::optional<Candidate> candidate() const {
        if (plane.axis < 0)
            return std::nullopt;
        return Candidate{plane, lower_count, upper_count, cost};
    }
};

// Where to look along an axis: the planes strictly between both faces of the cell.
struct SweptAxis {
    int axis;
    float lo, hi;
    SplitCost cost;

    SweptAxis(const BuildOptions &options, const Box3f &cell, int axis)
        : axis(axis), lo(cell.lo[axis]), hi(cell.hi[axis]), cost(options, cell, axis) {}

    void offer(float position, uint64_t lower_count, uint64_t upper_count,
               bool planar_below, BestPlane &best) const {
        const double offered = cost(position, lower_count, upper_count);
        if (is_cheaper(offered, best.cost))
            best = {offered, {axis, position, planar_below}, lower_count, upper_count};
    }
};

// Tries the planes at sorted events. `below` references begin in front of the first event,
// `above` end behind it or at it.
void sweep_events(std::span<const Event> events, uint64_t below, uint64_t above,
                  const SweptAxis &axis, BestPlane &best,
                  std::vector<PlanarEvents> *planar_groups = nullptr);

struct SweepResult {
    // The cheapest plane strictly inside the cell, if there is any. What lies in it goes to
    // the cheaper side. Among equals: the first axis, the lowest position, the lower side.
    std::optional<Candidate> best;
    std::vector<PlanarEvents> planar_groups;
};

// Tries both faces of the bounds of every reference (Wald and Havran 2006, algorithm 5).
// The cell has positive area.
void sweep(const CellContents &contents, const Box3f &cell, const BuildOptions &options,
           SweepResult &result);

} // namespace mlrt
