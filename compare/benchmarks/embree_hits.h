// What Embree hits of rays in any order.
#pragma once

#include "embree_engine.h"

#include <cstddef>
#include <cstdint>

namespace mlrt::bench {

// How rays are handed over: in packets of sixteen, as Mitsuba does it, which Embree is told
// are coherent or not, or as streams of incoherent single rays.
enum class ArrayMode { coherent_packets, incoherent_packets, single_rays };

// Nearest hits of rays that are given as triples of floats, in 0 < t: the distance or
// infinity, and the number of the face or NO_PRIMITIVE.
void closest_hits(const EmbreeScene &scene, const float *origins, const float *directions,
                  size_t count, ArrayMode mode, float *t, uint32_t *primitives);

} // namespace mlrt::bench
