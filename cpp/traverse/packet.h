// X2: sixteen rays walk the tree together, an interval each.
#pragma once

#include "traverse/packet_state.h"

#include <array>
#include <utility>

namespace mlrt {

namespace packet_detail {

struct Child {
    uint32_t node;
    ParameterInterval<FloatPacket> interval;
};

// The two children of an inner node with the intervals of the lanes, the one to visit first
// in front. Children are ordered by the side of the plane that the rays start on, not by
// the sign of their direction: a ray can only cross the plane if it moves towards it, so
// the child on the origin's side is the nearer one for every ray from there, however
// directions differ in sign.
inline std::pair<Child, Child> children(const RayPacket<CommonOrigin> &rays, LaneBits,
                                        KdNode node,
                                        const ParameterInterval<FloatPacket> &interval) {
    const int k = node.axis();
    const float to_plane = node.split() - rays.origin.point[k];
    const DividedInterval<FloatPacket> divided(interval, to_plane * rays.reciprocal[k]);
    const uint32_t above = to_plane < 0;
    return {{node.lower_child() + above, divided.origin_side},
            {node.lower_child() + 1 - above, divided.other_side}};
}

// Rays may start on both sides of the plane: intervals follow each ray's own side, the
// order of the children that of the first lane.
inline std::pair<Child, Child> children(const RayPacket<LaneOrigins> &rays, LaneBits lanes,
                                        KdNode node,
                                        const ParameterInterval<FloatPacket> &interval) {
    const int k = node.axis();
    const FloatPacket to_plane = node.split() - rays.origin.point[k];
    const DividedInterval<FloatPacket> divided(interval, to_plane * rays.reciprocal[k]);
    const MaskOf<FloatPacket> above = to_plane < 0.0f;
    const Child lower{node.lower_child(),
                      {select(above, divided.other_side.near, divided.origin_side.near),
                       select(above, divided.other_side.far, divided.origin_side.far)}};
    const Child upper{node.lower_child() + 1,
                      {select(above, divided.origin_side.near, divided.other_side.near),
                       select(above, divided.origin_side.far, divided.other_side.far)}};
    const bool upper_first = (to_bits(above) & lanes & (~lanes + 1)) != 0;
    return upper_first ? std::pair{upper, lower} : std::pair{lower, upper};
}

} // namespace packet_detail

template <Query query, typename Origin>
void trace_packet(const KdTree &tree, const RayPacket<Origin> &rays, const Entry &entry,
                  PacketState<query> &state, Counters &counters) {
    using packet_detail::Child;
    std::array<Child, MAX_TREE_DEPTH + 1> stack;
    int pending = 0;
    uint32_t node_index = entry.node;
    ParameterInterval<FloatPacket> interval = clip_to_cell(rays, entry.cell);
    // What was found in another subtree ends the interval.
    if (state.hits.found != 0)
        interval.far = minimum(interval.far, state.hits.t * WIDEN_FAR);
    LaneBits lanes = to_bits(interval.not_empty()) & state.searching;
    for (;;) {
        if (lanes == 0) {
            if (pending == 0)
                return;
            const Child &next = stack[--pending];
            node_index = next.node;
            interval = next.interval;
            interval.far = minimum(interval.far, state.hits.t * WIDEN_FAR);
            lanes = to_bits(interval.near <= minimum(interval.far, state.hits.t)) &
                    state.searching;
            continue;
        }
        const KdNode node = tree.node(node_index);
        ++counters.traversal_steps;
        if (node.is_leaf()) {
            ++counters.leaf_visits;
            state.test_leaf(tree, rays, lanes, node, counters);
            lanes = 0;
            continue;
        }
        const auto [first, second] = packet_detail::children(rays, lanes, node, interval);
        const LaneBits in_first = to_bits(first.interval.not_empty()) & lanes;
        const LaneBits in_second = to_bits(second.interval.not_empty()) & lanes;
        if (in_first != 0 && in_second != 0)
            stack[pending++] = second;
        const Child &next = in_first != 0 ? first : second;
        node_index = next.node;
        interval = next.interval;
        lanes = in_first != 0 ? in_first : in_second;
    }
}

} // namespace mlrt
