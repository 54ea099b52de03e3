#include "kdtree/sweep.h"

namespace mlrt {

void sweep_events(std::span<const Event> events, uint64_t below, uint64_t above,
                  const SweptAxis &axis, BestPlane &best,
                  std::vector<PlanarEvents> *planar_groups) {
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
        if (planar > 0 && planar_groups)
            planar_groups->push_back(
                {axis.axis, position, first_planar, planar, below, above});
        if (axis.lo < position && position < axis.hi) {
            axis.offer(position, below + planar, above, true, best);
            if (planar > 0)
                axis.offer(position, below, above + planar, false, best);
        }
        below += planar + starts;
    }
}

void sweep(const CellContents &contents, const Box3f &cell, const BuildOptions &options,
           SweepResult &result) {
    BestPlane best;
    result.planar_groups.clear();
    for (int axis = 0; axis < 3; ++axis)
        if (cell.lo[axis] < cell.hi[axis])
            sweep_events(contents.events[axis], 0, contents.count(),
                         SweptAxis(options, cell, axis), best, &result.planar_groups);
    result.best = best.candidate();
}

} // namespace mlrt
