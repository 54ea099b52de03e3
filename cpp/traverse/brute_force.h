// X0: sixteen rays against every finite triangle, without the tree.
#pragma once

#include "traverse/packet_state.h"

namespace mlrt {

template <Query query, typename Origin>
void trace_brute_force(const KdTree &tree, const RayPacket<Origin> &rays,
                       PacketState<query> &state, Counters &counters) {
    for (uint32_t primitive = 0; primitive < tree.triangles.size(); ++primitive)
        if (is_finite(tree.triangles[primitive]))
            state.test(rays, state.searching, tree.triangles[primitive], primitive,
                       counters);
}

} // namespace mlrt
