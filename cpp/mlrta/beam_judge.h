// Applies the chosen culling tests to a beam, for the entry point search.
#pragma once

#include "base/counters.h"
#include "mlrta/entry_point.h"
#include "mlrta/frustum_planes.h"
#include "mlrta/inverse_frustum.h"
#include "mlrta/occluder.h"
#include "mlrta/trace.h"

namespace mlrt {

class BeamJudge {
public:
    using Cell = BoxPacket; // see InverseFrustum

    BeamJudge(const KdTree &tree, const Beam &beam, const TraceOptions &options,
              Counters &counters)
        : tree_(tree), beam_(beam), frustum_(beam), culling_(options.culling),
          leaf_rejection_(options.leaf_rejection),
          covering_triangles_(options.covering_triangles && beam.has_corners),
          counters_(counters), t_max_(beam.t_max) {}

    // No ray has a first hit beyond this, the beam's own end included.
    double t_max() const { return t_max_; }

    bool knows(const Box3f &box) const {
        return frustum_.says_something(frustum_.inside(box));
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

    bool found_blocker() const { return t_max_ < beam_.t_max; }
    bool reaches(const Cell &cell) const {
        return !found_blocker() || !frustum_.out_of_reach(cell);
    }

    // No ray has a hit in a cell of which the judge knows() before this parameter, as
    // reported, rounded to float.
    float earliest_hit(const Box3f &box) const {
        return frustum_.earliest_entry(frustum_.inside(box));
    }

    // O1 and O3: looks for triangles that cover the beam, and lets it end there. The leaf
    // may reference more of the triangle than lies in its cell, since the whole beam ends
    // there anyway.
    void found(uint32_t, KdNode leaf) {
        if (!covering_triangles_ || leaf.is_unbuilt() ||
            leaf.reference_count() > MOST_COVER_TESTS)
            return;
        for (const uint32_t primitive : tree_.references_of(leaf))
            try_blocker(primitive);
    }

    // Lets the beam end at a triangle if that covers it.
    void try_blocker(uint32_t primitive) {
        if (!covering_triangles_)
            return;
        if (const auto t = covered_until(beam_, tree_.triangles[primitive]);
            t && *t < t_max_) {
            ++counters_.blockers;
            t_max_ = *t;
            blocker_ = primitive;
            frustum_.shorten(t_max_);
        }
    }

    // The triangle that the beam ends at, if one was found to cover it.
    uint32_t blocker() const { return blocker_; }

private:
    // In leaves with more triangles single ones are too small.
    static constexpr uint32_t MOST_COVER_TESTS = 16;

    const KdTree &tree_;
    const Beam &beam_;
    InverseFrustum frustum_;
    Culling culling_;
    LeafRejection leaf_rejection_;
    bool covering_triangles_;
    Counters &counters_;
    double t_max_;
    uint32_t blocker_ = NO_PRIMITIVE;
};

} // namespace mlrt
