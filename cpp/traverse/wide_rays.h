// Rays that are traced through the wide tree together, each on its own, and what is
// computed for them once, sixteen at a time.
#pragma once

#include "geometry/ray_packet.h"

#include <array>
#include <bit>
#include <cstdint>
#include <type_traits>

namespace mlrt {

struct WideRays {
    static constexpr uint32_t MOST = 256;
    template <typename Value>
    using Each = std::array<Value, MOST + PACKET_WIDTH>; // whole packets are written

    Each<float> origin[3], direction[3], reciprocal[3], t_min, t_max;
    // Of the axis of the largest component of the direction: see ShearedRay.
    Each<uint32_t> main_axis;
    Each<float> shear_x, shear_y;
    Each<uint32_t> number; // of the ray in its group
    uint32_t count = 0;

    bool has_room() const { return count + PACKET_WIDTH <= MOST; }

    // Adds those lanes of a packet, which begins with ray number `first` of a group. There
    // must be room for a packet.
    template <typename Origin>
    void add(const RayPacket<Origin> &rays, LaneBits lanes, uint32_t first) {
        const auto keep = [&](auto &values, const auto &packet) {
            store_compressed(&values[count], packet, lanes);
        };
        const Vec3<FloatPacket> &d = rays.direction;
        const FloatPacket size_x = absolute(d.x), size_y = absolute(d.y),
                          size_z = absolute(d.z);
        const auto is_x = (size_x > size_y) & (size_x > size_z);
        const auto is_z = ~is_x & ~(size_y > size_z);
        const auto pick = [](const auto &mask, const auto &yes, const auto &no) {
            return select(MaskOf<FloatPacket>(mask), yes, no);
        };
        const FloatPacket along = pick(is_x, d.x, pick(is_z, d.z, d.y));
        keep(shear_x, pick(is_x, d.y, d.x) / along);
        keep(shear_y, pick(is_z, d.y, d.z) / along);
        keep(main_axis,
             select(MaskOf<UIntPacket>(is_x), UIntPacket(0u),
                    select(MaskOf<UIntPacket>(is_z), UIntPacket(2u), UIntPacket(1u))));
        for (int k = 0; k < 3; ++k) {
            keep(direction[k], d[k]);
            keep(reciprocal[k], rays.reciprocal[k]);
            if constexpr (std::is_same_v<Origin, CommonOrigin>)
                keep(origin[k], FloatPacket(rays.origin.point[k]));
            else
                keep(origin[k], rays.origin.point[k]);
        }
        keep(t_min, rays.t_min);
        keep(t_max, rays.t_max);
        keep(number, UIntPacket(first) + lane_indices());
        count += uint32_t(std::popcount(lanes));
    }
};

} // namespace mlrt
