// What Embree hits of any rays, in packets of sixteen, as Mitsuba asks for them.
#pragma once

#include "embree_engine.h"

#include <cstddef>
#include <cstdint>

namespace mlrt::bench {

// Nearest hits of rays that are given as triples of floats, in 0 < t: the distance or
// infinity, and the number of the face or NO_PRIMITIVE. `coherent` is a hint to Embree.
void closest_hits(const EmbreeScene &scene, const float *origins, const float *directions,
                  size_t count, bool coherent, float *t, uint32_t *primitives);

} // namespace mlrt::bench
