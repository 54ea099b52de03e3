// Applies the chosen culling tests to a beam, for the entry point search.
#pragma once

#include "base/counters.h"
#include "mlrta/entry_point.h"
#include "mlrta/frustum_planes.h"
#include "mlrta/inverse_frustum.h"
#include "mlrta/trace.h"

namespace mlrt {

class BeamJudge {
public:
    BeamJudge(const Beam &beam, const TraceOptions &options, Counters &counters)
        : beam_(beam), options_(options), counters_(counters) {}

    void visit(uint32_t) { ++counters_.entry_steps; }

    Sides sides(uint32_t, KdNode node, const Box3f &cell) const {
        const AxisPlane plane{node.axis(), node.split()};
        const bool upper_is_near = mlrt::upper_is_near(beam_, plane);
        switch (options_.culling) {
        case Culling::none:
            break;
        case Culling::frustum_planes: {
            Box3f lower = cell, upper = cell;
            lower.hi[plane.axis] = node.split();
            upper.lo[plane.axis] = node.split();
            return {may_enter_by_planes(beam_, lower), may_enter_by_planes(beam_, upper),
                    upper_is_near};
        }
        case Culling::inverse_frustum:
            const Cull cull = cull_children(beam_, cell, plane);
            if (cull == Cull::near_only)
                return {!upper_is_near, upper_is_near};
            if (cull == Cull::far_only)
                return {upper_is_near, !upper_is_near};
            break;
        }
        return {true, true, upper_is_near};
    }

    bool possible(uint32_t, KdNode, const Box3f &cell) const {
        if (options_.culling == Culling::frustum_planes)
            return may_enter_by_planes(beam_, cell);
        switch (options_.leaf_rejection) {
        case LeafRejection::parameters:
            return may_enter_by_parameters(beam_, cell);
        case LeafRejection::slopes:
            return may_enter_by_slopes(beam_, cell);
        case LeafRejection::none:
            break;
        }
        return true;
    }

private:
    const Beam &beam_;
    const TraceOptions &options_;
    Counters &counters_;
};

} // namespace mlrt
