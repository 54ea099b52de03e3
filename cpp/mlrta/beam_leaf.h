// X4, beam-leaf traversal: the beam itself walks the tree, once for all of its rays, and
// each leaf's triangles are tested against the beam, then against its packets, and what
// remains against rays.
//
// Rays are not clipped to cells, so a triangle is tested once for the whole beam, however
// many leaves refer to it.
#pragma once

#include "base/counters.h"
#include "mlrta/beam_packets.h"
#include "traverse/query.h"

namespace mlrt {

// Finds for the active rays of a beam what they hit in the subtree: nearest hits by number
// of triangle, or any. The group is the one that the beam was loaded from.
//
// Gives up once it has tested more than `most_triangles` against the beam, and returns
// false: what has been found till then is true of Query::any, and of no use otherwise.
template <Query query>
bool trace_beam_leaf(const KdTree &tree, const RayGroup &rays, const Entry &entry,
                     uint32_t most_triangles, BeamPackets &beam, Counters &counters);

// Distances of the nearest hits that were found, as a packet of the group has them; other
// lanes hold any value.
FloatPacket hit_distances(const KdTree &tree, const RayGroup &rays,
                          const BeamPacket &packet, Vec3f origin, Counters &counters);

} // namespace mlrt
