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
    using Cell = BoxPacket; // see InverseFrustum

    BeamJudge(const Beam &beam, const TraceOptions &options, Counters &counters)
        : beam_(beam), frustum_(beam), culling_(options.culling),
          leaf_rejection_(options.leaf_rejection), counters_(counters) {}

    bool knows(const Box3f &box) const {
        return InverseFrustum::within_range(frustum_.inside(box));
    }
    Cell start(const Box3f &box) const { return frustum_.inside(box); }

    void visit(uint32_t) { ++counters_.entry_steps; }

    Sides sides(uint32_t, KdNode node, const Cell &cell) const {
        const AxisPlane plane{node.axis(), node.split()};
        if (culling_ == Culling::inverse_frustum) [[likely]]
            return frustum_.sides(cell, plane);
        bool lower = true, upper = true;
        if (culling_ == Culling::frustum_planes) {
            lower = may_enter_by_planes(beam_, child(cell, node, false));
            upper = may_enter_by_planes(beam_, child(cell, node, true));
        }
        return frustum_.upper_is_near(plane) ? Sides{upper, lower, true}
                                             : Sides{lower, upper, false};
    }

    Cell child(const Cell &cell, KdNode node, bool upper) const {
        return frustum_.child(cell, {node.axis(), node.split()}, upper);
    }

    bool possible(uint32_t, KdNode, const Cell &cell) const {
        if (culling_ == Culling::frustum_planes)
            return may_enter_by_planes(beam_, cell);
        switch (leaf_rejection_) {
        case LeafRejection::parameters:
            return frustum_.may_enter_by_parameters(cell);
        case LeafRejection::slopes:
            return frustum_.may_enter_by_slopes(cell);
        case LeafRejection::none:
            break;
        }
        return true;
    }

private:
    const Beam &beam_;
    InverseFrustum frustum_;
    Culling culling_;
    LeafRejection leaf_rejection_;
    Counters &counters_;
};

} // namespace mlrt
