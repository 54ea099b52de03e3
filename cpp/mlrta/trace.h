// The front door of the tracer: a group of rays in, hits or occlusion out.
#pragma once

#include "base/counters.h"
#include "kdtree/tree.h"
#include "mlrta/beam.h"
#include "mlrta/entry_point.h"
#include "traverse/ray_group.h"

#include <cstdint>

namespace mlrt {

// How rays are taken through the tree (mlrta component names in brackets). All of them
// return the same hits, bit for bit.
enum class Traversal : uint32_t {
    brute_force, // X0: every triangle, no tree
    single,      // X1: one ray at a time
    packet,      // X2: 16 rays at a time, an interval each
    interval,    // X3: 16 rays at a time, one interval for all (Reshetov et al. 2005,
                 // section 3.3)
    beam_leaf,   // X4: beams of up to 4096 rays, if they have a common origin or, where any
                 // hit will do, a common direction or not much between where they begin and
                 // end; else X2
    wide,     // through the wide tree, as packets where rays have a common origin and one
              // at a time else; X1 if it has not been made
    adaptive, // X4 as long as it pays; for rays that go alone the wide tree if it has been
              // made, else X1 or X2, whichever pays
};

// Whether beams are tried; packets of the paper alone trace all rays of a tile that its
// search does not miss.
constexpr bool has_beams(Traversal traversal) {
    return traversal == Traversal::beam_leaf || traversal == Traversal::adaptive;
}

// Step 2 of inverse frustum culling, at leaves [C2].
enum class LeafRejection : uint32_t {
    none,
    parameters, // mode P
    slopes,     // mode S
};

// Which children a beam may enter.
enum class Culling : uint32_t {
    none,            // both, always
    inverse_frustum, // step 1 at inner nodes [C1]
    frustum_planes,  // the classic test as control [C3], at leaves too: no leaf rejection
};

// A packet gains more from each node that it need not visit than a beam does, which visits
// it once for all of its rays: usual are MTS 32 and a frontier of 8 for packets with a
// common origin, MTS 64 and one entry point for beams, and for rays without a common
// origin, whose tiles rule out little.
struct TraceOptions {
    Traversal traversal = Traversal::adaptive;
    bool entry_points = true;   // MLRTA: search an entry point for each tile
    uint32_t initial_tile = 64; // ITS: rays along the side of a tile
    uint32_t minimum_tile = 0;  // MTS: tiles of at most this size are traced; 0: usual
    uint32_t split_factor = 4;  // SF: children of a tile that is split, 4 or 16
    LeafRejection leaf_rejection = LeafRejection::slopes;
    Culling culling = Culling::inverse_frustum;
    SearchOrder search_order = SearchOrder::shallow_first; // [E1, E2]
    uint32_t frontier = 0; // most subtrees that rays start at, up to 16; 0: usual [E3]
    // Beams end at triangles that stop all rays, and tiles of shadow rays are answered by
    // them where rays go in beams [O1, O3].
    bool covering_triangles = true;
};

// Nearest hits of all rays of the group. If the rays are those of a square of pixels,
// `tile` lets their beams be found from its corners; it changes no hit.
void trace_closest(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
                   HitGroup hits, Counters &counters, const CameraTile *tile = nullptr);

// For each ray 1 if anything lies in its interval, else 0.
void trace_any(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
               uint8_t *occluded, Counters &counters);

} // namespace mlrt
