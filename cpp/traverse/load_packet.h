// From the arrays of a group to packets.
#pragma once

#include "base/check.h"
#include "base/partial_packets.h"
#include "geometry/ray_packet.h"
#include "traverse/ray_group.h"

namespace mlrt {

// Differences of coordinates that are less do not overflow in single precision.
inline constexpr float LARGEST_COORDINATE = 0x1p125f;

// A packet, and the lanes that need a traversal of their own because an origin lies so far
// away, or a direction component is so large or small, that intersecting planes in single
// precision could lose it.
template <typename Origin>
struct LoadedPacket {
    RayPacket<Origin> rays;
    LaneBits extreme = 0;
};

// As many values as there are lanes from `first` on; those past `count` read as zero. For
// packets of one register among several, `first` may lie past it too.
template <typename Packet = FloatPacket>
[[gnu::always_inline]] inline Packet load_padded(const float *values, uint32_t first,
                                                 uint32_t count) {
    if (first + LANES_OF<Packet> <= count)
        return load<Packet>(values + first);
    MLRT_CHECK(first < count || LANES_OF<Packet> < PACKET_WIDTH);
    return load_first<Packet>(values + first, count - first);
}

// The same; what lies past `count` is inactive, since both ends of its interval are zero.
template <typename Packet = FloatPacket>
[[gnu::always_inline]] inline Packet load_padded(const IntervalEnds &ends, uint32_t first,
                                                 uint32_t count) {
    if (ends.each())
        return load_padded<Packet>(ends.each(), first, count);
    const Packet common(ends.common());
    if (first + LANES_OF<Packet> <= count)
        return common;
    return select(lane_numbers<Packet>() < Packet(float(int32_t(count - first))), common,
                  Packet(0.0f));
}

template <typename Origin>
LoadedPacket<Origin> load_packet(const RayGroup &group, uint32_t first) {
    // Reciprocals of what is moderate are moderate, and so are parameters of planes.
    constexpr float SMALLEST_COMPONENT = 0x1p-100f;
    constexpr float SMALLEST_DIRECTION = 0x1p-60f, LARGEST_DIRECTION = 0x1p60f;

    LoadedPacket<Origin> loaded;
    RayPacket<Origin> &rays = loaded.rays;
    // In this order NaN stays NaN, and the ray inactive.
    rays.t_min = maximum(FloatPacket(0.0f), load_padded(group.t_min, first, group.count));
    rays.t_max = load_padded(group.t_max, first, group.count);
    auto active = rays.t_min < rays.t_max;
    MaskOf<FloatPacket> far_away = false;
    if constexpr (std::is_same_v<Origin, CommonOrigin>) {
        rays.origin.point = group.common_origin;
        active &= MaskOf<FloatPacket>(is_finite(group.common_origin));
    } else {
        for (int k = 0; k < 3; ++k) {
            rays.origin.point[k] = load_padded(group.origin[k], first, group.count);
            active &= absolute(rays.origin.point[k]) < INFINITY;
            far_away |= absolute(rays.origin.point[k]) >= LARGEST_COORDINATE;
        }
    }
    FloatPacket largest = 0.0f;
    MaskOf<FloatPacket> small_component = false;
    for (int k = 0; k < 3; ++k) {
        const FloatPacket d = load_padded(group.direction[k], first, group.count);
        const FloatPacket size = absolute(d);
        rays.direction[k] = d;
        rays.reciprocal[k] = 1.0f / d;
        active &= size < INFINITY;
        largest = maximum(largest, size);
        small_component |= (size > 0.0f) & (size < SMALLEST_COMPONENT);
    }
    active &= largest > 0.0f;
    rays.active = to_bits(active);
    loaded.extreme = to_bits(far_away | small_component | (largest < SMALLEST_DIRECTION) |
                             (largest > LARGEST_DIRECTION)) &
                     rays.active;
    rays.active &= ~loaded.extreme;
    const auto counted = from_bits<FloatPacket>(rays.active);
    for (int k = 0; k < 3; ++k)
        rays.max_direction[k] =
            greatest_lane(select(counted, absolute(rays.direction[k]), FloatPacket(0.0f)));
    return loaded;
}

} // namespace mlrt
