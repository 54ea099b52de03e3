#include "kdtree/sweep.h"

namespace mlrt {

namespace {

struct Best {
    double cost = std::numeric_limits<double>::infinity();
    float position = 0;
    uint64_t lower_count = 0, upper_count = 0;
    bool planar_below = true;
    int axis = -1;
};

void sweep_axis(const CellContents &contents, const Box3f &cell,
                const BuildOptions &options, int axis, Best &best,
                std::vector<PlanarGroup> &planar_groups) {
    const SplitCost split_cost(options, cell, axis);
    const std::vector<Event> &events = contents.events[axis];
    const float lo = cell.lo[axis], hi = cell.hi[axis];

    const auto offer = [&](float position, uint64_t lower_count, uint64_t upper_count,
                           bool planar_below) {
        const double cost = split_cost(position, lower_count, upper_count);
        if (is_cheaper(cost, best.cost))
            best = {cost, position, lower_count, upper_count, planar_below, axis};
    };

    // Of the references: how many begin below the plane, and how many end above it.
    uint64_t below = 0, above = contents.count();
    for (size_t i = 0; i < events.size();) {
        const float position = events[i].position();
        const auto run = [&](EventType type) {
            const size_t first = i;
            while (i < events.size() && events[i].position() == position &&
                   events[i].type() == type)
                ++i;
            return uint64_t(i - first);
        };
        const uint64_t ends = run(EventType::end);
        const size_t first_planar = i;
        const uint64_t planar = run(EventType::planar);
        const uint64_t starts = run(EventType::start);

        above -= ends + planar;
        if (planar > 0)
            planar_groups.push_back({axis, position, first_planar, planar, below, above});
        if (lo < position && position < hi) {
            offer(position, below + planar, above, true);
            if (planar > 0)
                offer(position, below, above + planar, false);
        }
        below += planar + starts;
    }
}

} // namespace

void sweep(const CellContents &contents, const Box3f &cell, const BuildOptions &options,
           SweepResult &result) {
    Best best;
    result.planar_groups.clear();
    for (int axis = 0; axis < 3; ++axis)
        if (cell.lo[axis] < cell.hi[axis])
            sweep_axis(contents, cell, options, axis, best, result.planar_groups);
    result.best.reset();
    if (best.axis >= 0)
        result.best = Candidate{{best.axis, best.position, best.planar_below},
                                best.lower_count,
                                best.upper_count,
                                best.cost};
}

} // namespace mlrt
