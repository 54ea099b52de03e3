// The triangle that stopped a ray last: neighbours often stop there too.
#pragma once

#include "base/counters.h"
#include "kdtree/tree.h"
#include "traverse/packet_state.h"

#include <cstdint>

namespace mlrt {

template <typename Output>
class LastOccluder {
public:
    void remember(uint32_t primitive) { primitive_ = primitive; }

    // Of Query::any, those of the given lanes that stop there: they are answered.
    template <typename Origin>
    LaneBits stop(const KdTree &tree, const RayPacket<Origin> &packet, LaneBits lanes,
                  uint32_t first, Output &output, Counters &counters) const {
        if (Output::query == Query::closest || primitive_ == NO_PRIMITIVE)
            return 0;
        PacketState<Output::query> state(packet);
        state.test(packet, lanes, tree.triangles[primitive_], primitive_, counters);
        output.set(first, lanes, state);
        return state.hits.found & lanes;
    }

private:
    uint32_t primitive_ = NO_PRIMITIVE;
};

} // namespace mlrt
