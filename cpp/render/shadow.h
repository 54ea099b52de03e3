// Shadow rays: which samples of lights are visible.
#pragma once

#include "base/aligned_vector.h"
#include "base/counters.h"
#include "base/simd.h"
#include "mlrta/trace.h"
#include "render/hit_packet.h"
#include "render/prepared_scene.h"
#include "render/shadow_offset.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace mlrt {

// Light of one emitter that reaches points unless something is in the way.
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

    // Adds the lanes whose bit is set: `light` reaches the point `from`, which lies off its
    // surface (see shadow_offset.h), from the point `to`. The hits tell which camera rays
    // it is for.
    void append(LaneBits lanes, const HitPacket &hit, const Vec3<FloatPacket> &from,
                const Vec3<FloatPacket> &to, const Vec3<FloatPacket> &light);

    // Adds the light that nothing occludes to colours[k][ray], in the order given, and what
    // tracing takes to cost[ray] if `cost` is given.
    void trace(const SceneData &scene, const TraceOptions &options, Counters &counters,
               float *cost, std::span<float *const, 3> colours);

private:
    void reserve(size_t size);
    void find_occluded(const SceneData &scene, const TraceOptions &options,
                       Counters &counters, float *cost);

    struct Packet;
    static void add_light(const Packet &packet, LaneBits visible, const uint32_t *rays,
                          std::span<float *const, 3> colours);

    bool from_light_;
    Vec3f light_position_;
    std::optional<Vec3f> parallel_; // the direction of all rays, if they have the same
    float begin_, end_;             // of their intervals
    uint32_t count_ = 0;
    // One array a component, with room for a packet behind the last entry.
    AlignedVector<uint32_t> ray_;
    AlignedVector<float> origin_[3]; // if the rays do not start at the light
    AlignedVector<float> direction_[3];
    AlignedVector<float> cost_;
    AlignedVector<uint8_t> occluded_;
    // What was added at once: the lanes have light, and neighbouring entries above.
    struct Packet {
        Vec3<FloatPacket> light;     // any value in other lanes
        std::optional<size_t> first; // camera ray in lane 0, if the others follow it
        LaneBits lanes;
    };
    uint32_t packet_count_ = 0;
    std::vector<Packet> packets_; // and more, to be overwritten
};

} // namespace mlrt
