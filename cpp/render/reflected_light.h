// What surfaces reflect towards the camera, as far as nothing keeps the light from them.
#pragma once

#include "base/simd.h"
#include "render/hit_packet.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace mlrt {

// Kept by packets of camera rays, once for the shadow rays to all emitters: most lanes of a
// packet are lit by one of several.
class ReflectedLight {
public:
    void clear() { count_ = 0; }

    // Light for the camera rays of the hits; any value in lanes that are never shown.
    // Returns the packet's number.
    uint32_t add(const HitPacket &hit, const Vec3<FloatPacket> &light) {
        if (hit.first)
            return add(*hit.first, light);
        packet_to_set(light).rays = hit.ray;
        return count_++;
    }
    // The same for rays that follow each other from the first one on.
    uint32_t add(size_t first, const Vec3<FloatPacket> &light) {
        packet_to_set(light).first = first;
        return count_++;
    }

    // The light of these lanes of a packet arrives.
    void show(uint32_t number, LaneBits lanes) { packets_[number].shown |= lanes; }

    UIntPacket rays(uint32_t number) const {
        const Packet &packet = packets_[number];
        return packet.first ? UIntPacket(uint32_t(*packet.first)) + lane_indices()
                            : packet.rays;
    }

    // Adds what is shown to colours[k][ray], in the order in which packets were added.
    void add_to(std::span<float *const, 3> colours) const;

private:
    struct Packet {
        Vec3<FloatPacket> light;
        UIntPacket rays;             // camera rays, if they do not follow each other
        std::optional<size_t> first; // camera ray in lane 0, if they do
        LaneBits shown;
    };
    Packet &packet_to_set(const Vec3<FloatPacket> &light) {
        if (count_ == packets_.size())
            packets_.resize(std::max<size_t>(PACKET_WIDTH, 2 * packets_.size()));
        Packet &packet = packets_[count_];
        packet.light = light;
        packet.first = std::nullopt;
        packet.shown = 0;
        return packet;
    }

    uint32_t count_ = 0;
    std::vector<Packet> packets_; // and more, to be overwritten
};

} // namespace mlrt
