// Distances of sixteen hits, each in a triangle of its own.
#pragma once

#include "base/counters.h"
#include "base/magnitude.h"
#include "geometry/ray_packet.h"
#include "geometry/triangle.h"
#include "geometry/triangle_test.h"

#include <bit>
#include <cstdint>

namespace mlrt {

// What hit_distance() gives for each of the given lanes, one at least, which must hit their
// triangle; other lanes get any value.
template <typename Origin>
FloatPacket hit_distances(const RayPacket<Origin> &rays, LaneBits lanes,
                          const UIntPacket &primitives, const Triangle *triangles,
                          Counters &counters) {
    const auto known = from_bits<UIntPacket>(lanes);
    const uint32_t any = lane_of(primitives, uint32_t(std::countr_zero(lanes)));
    const LaneArray<uint32_t> numbers =
        to_lanes<uint32_t>(select(known, primitives, UIntPacket(any)));
    LaneArray<float> coordinates[9];
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const float *from = &triangles[numbers[lane]].a.x;
        for (uint32_t i = 0; i < 9; ++i)
            coordinates[i][lane] = from[i];
    }
    const auto vertex = [&](uint32_t first) -> Vec3<DoublePacket> {
        return {to_double(load<FloatPacket>(coordinates[first])),
                to_double(load<FloatPacket>(coordinates[first + 1])),
                to_double(load<FloatPacket>(coordinates[first + 2]))};
    };
    const Vec3<DoublePacket> a = vertex(0);
    const PlaneOf<DoublePacket> plane(a, vertex(3), vertex(6));
    const auto o = to_double(rays.origin.point);
    const Vec3<DoublePacket> direction = to_double(rays.direction);
    const DoublePacket max_direction = largest_component(direction);
    const PlaneNumerator<DoublePacket> numerator(
        plane, Vec3<DoublePacket>{a.x - o.x, a.y - o.y, a.z - o.z});
    const PlaneDistance<DoublePacket> distance(plane, numerator, direction, max_direction);
    FloatPacket t = distance.template rounded<FloatPacket>();
    const LaneBits certain = to_bits(distance.template certain<FloatPacket>());
    for_each_lane(lanes & ~certain, [&](uint32_t lane) {
        ++counters.exact_distances;
        t.entry(lane) = exact_distance(rays.origin.of_lane(lane), rays.lane_direction(lane),
                                       triangles[numbers[lane]]);
    });
    return t;
}

} // namespace mlrt
