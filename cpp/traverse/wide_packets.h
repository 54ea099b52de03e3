// Packets of rays with a common origin through the wide tree: for dense scans, where
// neighbouring rays enter the same nodes but hit different triangles.
//
// A packet visits a node once for all of its rays that enter it, and tests a block for two
// of them at a time, with eight triangles. Packets that are next to each other go through
// the top of the tree together.
#pragma once

#include "base/counters.h"
#include "geometry/ray_packet.h"
#include "geometry/triangle.h"
#include "kdtree/wide_tree.h"
#include "traverse/query.h"

#include <cstdint>
#include <span>

namespace mlrt {

// Sixteen rays of a group, from `first` on, of which the active ones are traced.
struct WidePacket {
    RayPacket<CommonOrigin> rays;
    uint32_t first;
    int main_axis; // along which all of them move most
    float side;    // the sign of their directions there

    // Takes the axis along which the ray in the middle of the given ones moves most, one at
    // least, and returns those of them that go along with it.
    LaneBits choose_axis(LaneBits lanes);
};

// The nearest triangles of those lanes that found one, or any.
struct WideHits {
    UIntPacket primitive;
    LaneBits found;
};

// Packets take turns, as a step mostly waits for memory; `hits` has room for one each, in
// their order. Those of triangle_test.h, as by every other traversal. Triangles are those
// that the tree has copies of.
void trace_wide_packets(const WideTree &tree, const Triangle *triangles,
                        std::span<const WidePacket> packets, Query query, WideHits *hits,
                        Counters &counters);

} // namespace mlrt
