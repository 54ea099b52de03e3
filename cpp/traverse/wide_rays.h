// Rays that are traced through the wide tree together, each on its own, and what is
// computed for them once, sixteen at a time.
#pragma once

#include "geometry/ray_packet.h"
#include "traverse/hit_depth.h"

#include <array>
#include <cstdint>
#include <type_traits>

namespace mlrt {

// What a ray is to boxes and to triangles, and what it has found.
//
// Triangles are seen along the axis k of the largest component of the direction d.
struct alignas(CACHE_LINE) WideRay {
    // The faces of a box that a ray crosses first and last: as bytes into a WideNode.
    struct Faces {
        uint16_t first, last;
    };

    std::array<float, 3> origin;
    // Reciprocals of the direction, less and more by what parameters of faces may be off.
    std::array<float, 3> enter, leave;
    float search_from, search_end; // no parameter outside is of interest
    std::array<Faces, 3> faces;    // by axis
    uint32_t octant;               // as in WideNode
    uint32_t number;               // of the ray among WideRays

    std::array<uint8_t, 4> axes; // the axis k is the third one, the fourth place is unused
    std::array<float, 3> ordered_origin; // by these axes
    std::array<float, 2> slopes;         // of the first two to |d_k|
    float side, size, per_size;          // sign of d_k, |d_k| and its reciprocal
    // Depths up to which hits certainly do not count, and from which on they do.
    float before, begin;
    DepthHit best;
};

static_assert(sizeof(WideRay) == 2 * CACHE_LINE);

struct WideRays {
    static constexpr uint32_t MOST = 256;
    template <typename Value>
    using Each = std::array<Value, MOST + PACKET_WIDTH>; // whole packets are written

    Each<float> origin[3], direction[3], t_min, t_max;
    Each<uint32_t> number;   // of the ray in its group
    Each<WideRay> beginning; // of which nothing is found yet
    uint32_t count = 0;

    bool has_room() const { return count + PACKET_WIDTH <= MOST; }

    // Adds those lanes of a packet, which begins with ray number `first` of a group. There
    // must be room for a packet.
    void add(const RayPacket<LaneOrigins> &rays, LaneBits lanes, uint32_t first);
    void add(const RayPacket<CommonOrigin> &rays, LaneBits lanes, uint32_t first) {
        add({{in_all_lanes(rays.origin.point)},
             rays.direction,
             rays.reciprocal,
             rays.t_min,
             rays.t_max,
             rays.max_direction,
             rays.active},
            lanes, first);
    }
};

} // namespace mlrt
