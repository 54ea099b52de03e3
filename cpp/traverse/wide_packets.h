// Packets of rays with a common origin through the wide tree: for dense scans, where
// neighbouring rays enter the same nodes but hit different triangles.
#pragma once

#include "base/counters.h"
#include "geometry/ray_packet.h"
#include "geometry/triangle.h"
#include "kdtree/wide_tree.h"
#include "traverse/query.h"

#include <cstdint>
#include <span>

namespace mlrt {

// Sixteen rays of a group, from `first` on, of which the active ones are traced: all of
// them go along one axis.
struct WidePacket {
    RayPacket<CommonOrigin> rays;
    uint32_t first = 0;
    uint32_t main_axis = 0;
    float side = 1; // of the main axis, that all rays go to

    // Lanes of a packet that go along the axis of the one in the middle of them.
    LaneBits choose_axis(LaneBits lanes);
};

// The nearest triangles, or any, of the lanes that found one.
struct WideHits {
    UIntPacket primitive;
    LaneBits found;
};

// Packets take turns, as a step mostly waits for memory; `hits` has room for one each.
// Those of triangle_test.h, as by every other traversal.
void trace_wide_packets(const WideTree &tree, const Triangle *triangles,
                        std::span<const WidePacket> packets, Query query, WideHits *hits, Counters &counters);

} // namespace mlrt
