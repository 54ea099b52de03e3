// X4, beam-leaf traversal: the beam itself walks the tree, once for all of its rays, and
// each leaf's triangles are tested against the beam, then against its packets, and what
// remains against rays.
//
// Rays are not clipped to cells, so a triangle is tested once for the whole beam, however
// many leaves refer to it.
#pragma once

#include "base/counters.h"
#include "mlrta/beam_budget.h"
#include "mlrta/beam_packets.h"
#include "mlrta/frontier.h"
#include "mlrta/hit_distances.h"
#include "mlrta/mailbox.h"

#include <array>
#include <cstdint>

namespace mlrt {

// What the beams of a group leave to the next ones.
struct BeamMemory {
    // That of this thread, for a new group of rays, which have the given origin if they
    // have a common one. It is too much for the stacks of some threads.
    static BeamMemory &of_thread(const KdTree &tree, Vec3f origin);

    HitDistances distances;
    Mailbox mailbox;
    BeamPackets beam; // the one that is traced

    // Triangles that stopped rays of the last beam, of Query::any: they are likely to stop
    // those of the next one too, and tested first.
    std::array<uint32_t, WIDE_WIDTH> occluders;
    uint32_t occluder_count = 0;

    // Triangles of which rays of the last beam, of Query::closest, took one as the nearest
    // for some time; or as many of them as there is room for, which are nearly always all.
    std::array<uint32_t, HitDistances::MOST_PREPARED> hit;
    uint32_t hit_count = 0;
};

// Finds for the active rays of a beam what they hit in the subtrees of a frontier: the
// nearest triangles, or any. The group is the one that the beam was loaded from.
//
// Gives up once the budget is spent, and returns false: what has been found till then is
// true of Query::any, and of no use otherwise.
template <Query query>
bool trace_beam_leaf(const KdTree &tree, const RayGroup &rays, const Frontier &frontier,
                     BeamMemory &memory, const BeamBudget &budget, BeamPackets &beam,
                     Counters &counters);

} // namespace mlrt
