// Tile splitting: how the rays of a tile are dealt out to smaller tiles (Reshetov,
// Soupikov, Hurley 2005, section 3.1).
#pragma once

#include "base/simd.h"

#include <algorithm>
#include <cstdint>

namespace mlrt {

// A tile is a run of consecutive rays of a group. Where those of a square of pixels come in
// Morton order, the quarters and sixteenths of a square's run are the runs of its parts.
struct Tile {
    uint32_t first, count;
};

// Calls visit(child) for each part of a tile, in order: at most split_factor runs, all but
// the last of as many packets, a power of four so that squares stay whole. A tile of one
// packet has one part, itself.
template <typename Visit>
void for_each_child(Tile tile, uint32_t split_factor, Visit &&visit) {
    const uint32_t share = (tile.count + split_factor - 1) / split_factor;
    uint64_t step = PACKET_WIDTH;
    while (step < share)
        step *= 4;
    for (uint64_t offset = 0; offset < tile.count; offset += step)
        visit(Tile{tile.first + uint32_t(offset),
                   uint32_t(std::min(step, tile.count - offset))});
}

} // namespace mlrt
