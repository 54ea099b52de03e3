#include "mlrta/beam_leaf.h"

#include "base/block_order.h"
#include "geometry/triangle_test.h"
#include "mlrta/beam_triangle_tests.h"
#include "mlrta/parallel_walk.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace mlrt {

namespace {

// Depths at which the rays of a beam cross a plane across one axis, for a plane ahead at a
// distance of one: at least `first`, at most `last`.
struct CrossingDepths {
    float first, last;
};

// Takes a beam through subtrees, front to back.
template <Query query>
class BeamWalk {
public:
    BeamWalk(const KdTree &tree, const BeamPackets &beam, BeamTriangleTests<query> &tests,
             Counters &counters)
        : tree_(tree), beam_(beam), tests_(tests), counters_(counters) {
        prepare_crossings();
        prepare_sides();
    }

    // Returns false if the beam was given up.
    bool walk(const Entry &entry);

private:
    struct Depths {
        float near, far; // at which the beam is in a cell
    };

    // Bounds relative to the origin: lower ones in lanes 0 to 2, upper ones in 4 to 6.
    using Cell = FloatBlock;
    static constexpr uint32_t UPPER = 4;

    // A child that waits for the nearer one.
    struct Pending {
        Cell cell;
        Depths depths;
        uint32_t node;
    };

    void prepare_crossings();
    void prepare_sides();
    Depths depths_in(const Box3f &cell) const;
    bool beside(const Cell &cell) const;

    const KdTree &tree_;
    const BeamPackets &beam_;
    BeamTriangleTests<query> &tests_;
    Counters &counters_;
    std::array<std::array<CrossingDepths, 2>, 3> crossing_; // by axis and side of the plane
    // Of the four sides of the beam, twice: outward normals, and the lanes of the cell's
    // bounds that they point away from.
    Vec3<FloatBlock> side_normals_;
    std::array<UIntBlock, 3> innermost_;
    float side_slack_ = 0;
};

// A slope in [lo, hi] crosses a plane at distance q at a depth in [q / hi, q / lo], if it
// leads there. The slopes have two roundings, and the products to come two more.
template <Query query>
void BeamWalk<query>::prepare_crossings() {
    const auto towards = [](float lo, float hi) -> CrossingDepths {
        return {hi > 0 ? WIDEN_NEAR / hi : INFINITE, lo > 0 ? WIDEN_FAR / lo : INFINITE};
    };
    for (int n = 0; n < 3; ++n) {
        const float lo = n == 2 ? beam_.side : beam_.slope_lo[n];
        const float hi = n == 2 ? beam_.side : beam_.slope_hi[n];
        crossing_[beam_.axes[n]] = {towards(lo, hi), towards(-hi, -lo)};
    }
}

// The planes through the origin that bound the rectangle: outside where
// +-(p - center) - half > 0, times the depth.
template <Query query>
void BeamWalk<query>::prepare_sides() {
    const SlopeRectangle &r = beam_.rectangle;
    const auto [i, j, k] = beam_.axes;
    const float c = r.cosine, s = r.sine;
    const float u = beam_.slope_u + r.center_u, v = beam_.slope_v + r.center_v;
    const float at_p = u * c + v * s;
    const float at_q = v * c - u * s;
    const float less_p = beam_.side * (-at_p - r.half_p);
    const float more_p = beam_.side * (at_p - r.half_p);
    const float less_q = beam_.side * (-at_q - r.half_q);
    const float more_q = beam_.side * (at_q - r.half_q);
    side_normals_[i] = FloatBlock(c, -c, -s, s, c, -c, -s, s);
    side_normals_[j] = FloatBlock(s, -s, c, -c, s, -s, c, -c);
    side_normals_[k] =
        FloatBlock(less_p, more_p, less_q, more_q, less_p, more_p, less_q, more_q);
    for (uint32_t axis = 0; axis < 3; ++axis)
        innermost_[axis] = select(MaskOf<UIntBlock>(side_normals_[int(axis)] < 0.0f),
                                  UIntBlock(UPPER + axis), UIntBlock(axis));
    // Sixteen roundings of terms of at most this size are more than there are; and of
    // denormal numbers a few units more.
    const Box3f &bounds = tree_.bounds;
    const float reach = std::max(max_component(abs(bounds.lo - beam_.origin)),
                                 max_component(abs(bounds.hi - beam_.origin)));
    const float greatest_sum =
        1 + std::abs(beam_.slope_u) + std::abs(beam_.slope_v) + beam_.spread;
    side_slack_ = 16 * FLOAT_ROUNDOFF * reach * (2 + 2 * greatest_sum) + 0x1p-140f;
}

// Whether a cell lies wholly on the outer side of one of the beam's sides.
template <Query query>
bool BeamWalk<query>::beside(const Cell &cell) const {
    FloatBlock innermost(-side_slack_);
    for (uint32_t axis = 0; axis < 3; ++axis)
        innermost =
            fused(side_normals_[int(axis)], permuted(cell, innermost_[axis]), innermost);
    return any_lane(innermost > 0.0f);
}

// Those at which the beam is in a cell, which is given relative to the origin.
template <Query query>
BeamWalk<query>::Depths BeamWalk<query>::depths_in(const Box3f &cell) const {
    Depths depths{0, INFINITE};
    for (int axis = 0; axis < 3; ++axis) {
        const float lo = cell.lo[axis], hi = cell.hi[axis];
        const auto &crossing = crossing_[axis];
        if (lo > 0) {
            depths.near = std::max(depths.near, lo * crossing[0].first - TINY_PARAMETER);
            depths.far = std::min(depths.far, hi * crossing[0].last + TINY_PARAMETER);
        } else if (hi < 0) {
            depths.near = std::max(depths.near, -hi * crossing[1].first - TINY_PARAMETER);
            depths.far = std::min(depths.far, -lo * crossing[1].last + TINY_PARAMETER);
        }
    }
    return depths;
}

template <Query query>
bool BeamWalk<query>::walk(const Entry &entry) {
    std::array<Pending, MAX_TREE_DEPTH + 1> stack;
    uint32_t pending = 0;
    const Vec3f lo = entry.cell.lo - beam_.origin, hi = entry.cell.hi - beam_.origin;
    Depths depths = depths_in({lo, hi});
    if (!(depths.near <= depths.far && depths.near < INFINITE) ||
        depths.near > tests_.far_end() || tests_.all_done())
        return true;
    Cell cell(lo.x, lo.y, lo.z, 0, hi.x, hi.y, hi.z, 0);
    KdNode node = tree_.node(entry.node);
    for (;;) {
        ++counters_.beam_steps;
        if (!node.is_leaf()) {
            // Read both before the choice between them is known.
            const KdNode lower = load_node(tree_.nodes[node.lower_child()]);
            const KdNode upper = load_node(tree_.nodes[node.lower_child() + 1]);
            const uint32_t axis = uint32_t(node.axis());
            const float distance = node.split() - beam_.origin[int(axis)];
            const bool above = distance < 0;
            // Of both sides of the plane, so that no load waits for where the origin lies.
            const auto &[upwards, downwards] = crossing_[axis];
            // Not a number if the origin lies in the plane: comparisons are written so
            // that both sides are visited then.
            const float first =
                (above ? -distance * downwards.first : distance * upwards.first) -
                TINY_PARAMETER;
            const float last =
                (above ? -distance * downwards.last : distance * upwards.last) +
                TINY_PARAMETER;
            const bool enter_near =
                !(last < depths.near) & !(above ? upper : lower).is_empty_leaf();
            const bool enter_far = !(first > minimum(tests_.far_end(), depths.far)) &
                                   !(above ? lower : upper).is_empty_leaf();
            if (enter_near | enter_far) {
                // Without branches, as nobody foresees where a beam goes. What waits is
                // written even if it does not wait, and where only the far side is entered
                // that begins no later than the cell.
                const bool to_lower = enter_near != above;
                stack[pending] = {with_lane(cell, axis + UPPER * above, distance),
                                  {maximum(first, depths.near), depths.far},
                                  node.lower_child() + 1 - above};
                pending += uint32_t(enter_near & enter_far);
                const uint32_t index = node.lower_child() + !to_lower;
                depths.far = enter_near ? minimum(last, depths.far) : depths.far;
                cell = with_lane(cell, axis + UPPER * to_lower, distance);
                node = chosen(!to_lower, lower, upper);
                if (node.is_unbuilt()) [[unlikely]]
                    node = tree_.node(index);
                continue;
            }
        } else if (node.reference_count() > 0 && !beside(cell)) {
            ++counters_.leaf_visits;
            tests_.test_leaf(node);
            if (tests_.spent())
                return false;
        }
        for (;;) {
            if (pending == 0)
                tests_.flush();
            // What went beyond the budget was not tested, unless any hit will do.
            if (pending == 0 || tests_.all_done())
                return query == Query::any || !tests_.spent();
            const Pending &next = stack[--pending];
            if (next.depths.near > tests_.far_end() || beside(next.cell))
                continue;
            cell = next.cell;
            depths = next.depths;
            node = tree_.node(next.node);
            break;
        }
    }
}

} // namespace

BeamMemory &BeamMemory::of_thread(const KdTree &tree, Vec3f origin) {
    thread_local const auto kept = std::make_unique<BeamMemory>();
    kept->distances.start(tree, origin);
    kept->occluder_count = kept->hit_count = 0;
    return *kept;
}

template <Query query>
bool trace_beam_leaf(const KdTree &tree, const RayGroup &rays, const Frontier &frontier,
                     BeamMemory &memory, const BeamBudget &budget, BeamPackets &beam,
                     Counters &counters) {
    BeamTriangleTests<query> tests(tree, rays, memory.distances, memory.mailbox, budget,
                                   beam, counters);
    bool done = true;
    if (memory.occluder_count > 0)
        tests.test_first({memory.occluders.data(), memory.occluder_count});
    const auto take_through = [&](auto walk) {
        for (uint32_t i = 0; i < frontier.count && done; ++i)
            done = walk.walk(frontier.entries[i]);
    };
    if (!tests.all_done()) {
        if constexpr (query == Query::any) {
            if (beam.parallel)
                take_through(ParallelWalk(tree, beam, tests, counters));
            else
                take_through(BeamWalk<query>(tree, beam, tests, counters));
        } else {
            take_through(BeamWalk<query>(tree, beam, tests, counters));
        }
    }
    const std::span<const uint32_t> hit = tests.hit();
    std::ranges::copy(hit,
                      query == Query::any ? memory.occluders.begin() : memory.hit.begin());
    (query == Query::any ? memory.occluder_count : memory.hit_count) = uint32_t(hit.size());
    return done;
}

template bool trace_beam_leaf<Query::closest>(const KdTree &, const RayGroup &,
                                              const Frontier &, BeamMemory &,
                                              const BeamBudget &, BeamPackets &,
                                              Counters &);
template bool trace_beam_leaf<Query::any>(const KdTree &, const RayGroup &,
                                          const Frontier &, BeamMemory &,
                                          const BeamBudget &, BeamPackets &, Counters &);

} // namespace mlrt
