// Shadow rays: which samples of lights are visible.
#pragma once

#include "base/aligned_vector.h"
#include "base/counters.h"
#include "base/partial_packets.h"
#include "base/simd.h"
#include "mlrta/trace.h"
#include "render/prepared_scene.h"
#include "render/reflected_light.h"
#include "render/shadow_offset.h"

#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

namespace mlrt {

// Of one emitter, to the points that it lights unless something is in the way.
//
// For point and spot lights shadow rays start at the light, so that they share an origin
// and form a beam; the interval leaves out the same share at the light's end as in Mitsuba,
// where they run the other way. With robust offsets it leaves out nothing, and lights that
// are far away are traced from the surfaces.
class ShadowRays {
public:
    ShadowRays(const PreparedScene &scene, uint32_t emitter, ShadowOffset offset);

    bool from_light() const { return from_light_; }

    void clear() { count_ = packet_count_ = 0; }

    // Adds the lanes whose bit is set, of a packet of reflected light: it is seen unless
    // something lies between the point `from`, which lies off its surface (see
    // shadow_offset.h), and the point `to`.
    void append(LaneBits lanes, uint32_t packet, const Vec3<FloatPacket> &from,
                const Vec3<FloatPacket> &to) {
        reserve(count_ + PACKET_WIDTH);
        packets_[packet_count_++] = {packet, lanes};
        const uint32_t first = count_;
        count_ += uint32_t(std::popcount(lanes));
        for (int k = 0; k < 3; ++k) {
            float *direction = direction_[k].data() + first;
            if (from_light_) {
                store_compressed(direction, from[k] - to[k], lanes);
                continue;
            }
            store_compressed(&origin_[k][first], from[k], lanes);
            store_compressed(direction,
                             parallel_ ? FloatPacket((*parallel_)[k]) : to[k] - from[k],
                             lanes);
        }
    }

    // Shows the light that nothing occludes, and adds what tracing takes to cost[ray] of
    // camera rays if `cost` is given.
    void trace(const SceneData &scene, const TraceOptions &options, Counters &counters,
               float *cost, ReflectedLight &light);

private:
    void reserve(size_t size) {
        if (occluded_.size() < size)
            grow(size);
    }
    void grow(size_t size);
    void find_occluded(const SceneData &scene, const TraceOptions &options,
                       Counters &counters, float *cost, const ReflectedLight &light);

    bool from_light_;
    Vec3f light_position_;
    std::optional<Vec3f> parallel_; // the direction of all rays, if they have the same
    float begin_, end_;             // of their intervals
    uint32_t count_ = 0;
    // One array a component, with room for a packet behind the last entry.
    AlignedVector<float> origin_[3]; // if the rays do not start at the light
    AlignedVector<float> direction_[3];
    AlignedVector<float> cost_;
    AlignedVector<uint8_t> occluded_;
    // What was added at once: neighbouring entries above, one a lane.
    struct Packet {
        uint32_t number; // of reflected light
        LaneBits lanes;
    };
    uint32_t packet_count_ = 0;
    std::vector<Packet> packets_; // and more, to be overwritten
};

} // namespace mlrt
