// X3: sixteen rays walk the tree together with one interval for all of them (Reshetov,
// Soupikov, Hurley 2005, section 3.3, "interval traversal").
//
// A node costs one scalar decision instead of sixteen, but a lane is tested against
// whatever any other lane needs: a superset of the leaves of X2, hence the same hits.
#pragma once

#include "traverse/packet_state.h"

#include <array>

namespace mlrt {

namespace interval_detail {

// Range of the parameter at which the rays of a group cross a split plane, over the rays
// that do; `some_stay` if a ray may never cross it, because it moves away or along it.
struct PlaneRange {
    float first = INFINITE, last = -INFINITE;
    bool some_stay = false;
};

template <typename Origin>
PlaneRange plane_range(const RayPacket<Origin> &rays, LaneBits lanes, KdNode node) {
    const int k = node.axis();
    const FloatPacket parameter =
        (node.split() - rays.origin.point[k]) * rays.reciprocal[k];
    const auto counted = from_bits<FloatPacket>(lanes);
    const auto ahead = (parameter > TINY_PARAMETER) & counted;
    const auto behind = (parameter < -TINY_PARAMETER) & counted;
    const LaneBits ahead_bits = to_bits(ahead), behind_bits = to_bits(behind);
    if ((lanes & ~(ahead_bits | behind_bits)) != 0)
        return {-INFINITE, INFINITE, true}; // a ray starts in the plane: both sides
    return {least_lane(select(ahead, parameter * WIDEN_NEAR, FloatPacket(INFINITE))),
            greatest_lane(select(ahead, parameter * WIDEN_FAR, FloatPacket(-INFINITE))),
            behind_bits != 0};
}

// Whether all rays start on one side of the plane, and on which: 0 lower, 1 upper, -1
// mixed.
inline int origin_side(const RayPacket<CommonOrigin> &rays, LaneBits, KdNode node) {
    return node.split() < rays.origin.point[node.axis()] ? 1 : 0;
}

inline int origin_side(const RayPacket<LaneOrigins> &rays, LaneBits lanes, KdNode node) {
    const LaneBits above =
        to_bits(FloatPacket(node.split()) < rays.origin.point[node.axis()]) & lanes;
    return above == 0 ? 0 : above == lanes ? 1 : -1;
}

} // namespace interval_detail

// Traces the given lanes of the packet. They should be coherent: the interval of rays that
// cross each other covers all of the tree.
template <Query query, typename Origin>
void trace_interval(const KdTree &tree, const RayPacket<Origin> &rays, LaneBits lanes,
                    const Entry &entry, PacketState<query> &state, Counters &counters) {
    struct Pending {
        uint32_t node;
        ParameterInterval<float> interval;
    };
    std::array<Pending, MAX_TREE_DEPTH + 1> stack;
    int pending = 0;

    ParameterInterval<FloatPacket> clipped = clip_to_cell(rays, entry.cell);
    // What was found in another subtree ends the interval.
    if (state.hits.found != 0)
        clipped.far = minimum(clipped.far, state.hits.t * WIDEN_FAR);
    lanes &= to_bits(clipped.not_empty()) & state.searching;
    if (lanes == 0)
        return;
    const auto counted = from_bits<FloatPacket>(lanes);
    ParameterInterval<float> cell{
        least_lane(select(counted, clipped.near, FloatPacket(INFINITE))),
        greatest_lane(select(counted, clipped.far, FloatPacket(-INFINITE)))};

    // Greatest parameter at which any ray that is still searching could improve.
    const auto search_end = [&] {
        return greatest_lane(select(from_bits<FloatPacket>(lanes & state.searching),
                                    state.hits.t, FloatPacket(-INFINITE)));
    };

    uint32_t node_index = entry.node;
    for (;;) {
        const KdNode node = tree.node(node_index);
        ++counters.traversal_steps;
        if (!node.is_leaf()) {
            const int side = interval_detail::origin_side(rays, lanes, node);
            const uint32_t near_child = node.lower_child() + (side == 1);
            const uint32_t far_child = node.lower_child() + (side != 1);
            const auto plane = interval_detail::plane_range(rays, lanes, node);
            const float last_exit = plane.some_stay ? INFINITE : plane.last;
            if (side < 0) {
                stack[pending++] = {far_child, cell};
                node_index = near_child;
            } else if (cell.far < plane.first) {
                node_index = near_child;
            } else if (cell.near > last_exit) {
                node_index = far_child;
            } else {
                stack[pending++] = {far_child,
                                    {std::max(cell.near, plane.first), cell.far}};
                cell.far = std::min(cell.far, last_exit);
                node_index = near_child;
            }
            continue;
        }
        ++counters.leaf_visits;
        state.test_leaf(tree, rays, lanes & state.searching, node, counters);
        const float end = search_end();
        do {
            if (pending == 0)
                return;
            cell = stack[--pending].interval;
            node_index = stack[pending].node;
        } while (!(cell.near <= end));
        cell.far = std::min(cell.far, end * WIDEN_FAR);
    }
}

} // namespace mlrt
