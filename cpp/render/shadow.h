// Shadow rays: which samples of lights are visible.
#pragma once

#include "base/counters.h"
#include "base/simd.h"
#include "mlrta/trace.h"
#include "render/prepared_scene.h"
#include "render/shadow_offset.h"

#include <cstdint>
#include <optional>
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

    void clear() { count_ = 0; }

    // Adds the lanes whose bit is set: `light` reaches the point `from`, which lies off its
    // surface (see shadow_offset.h), from the point `to`. `ray` is the camera ray that it
    // is for.
    void append(LaneBits lanes, const UIntPacket &ray, const Vec3<FloatPacket> &from,
                const Vec3<FloatPacket> &to, const Vec3<FloatPacket> &light);

    // Calls visible(ray, light) for all that nothing occludes, in the order given. What
    // tracing takes is added to cost[ray] if `cost` is given.
    template <typename Visible>
    void trace(const SceneData &scene, const TraceOptions &options, Counters &counters,
               float *cost, Visible &&visible) {
        if (count_ == 0)
            return;
        find_occluded(scene, options, counters, cost);
        for (uint32_t i = 0; i < count_; ++i)
            if (!occluded_[i])
                visible(ray_[i], Vec3f{light_[0][i], light_[1][i], light_[2][i]});
    }

private:
    void reserve(size_t size);
    void find_occluded(const SceneData &scene, const TraceOptions &options,
                       Counters &counters, float *cost);

    bool from_light_;
    Vec3f light_position_;
    std::optional<Vec3f> parallel_; // the direction of all rays, if they have the same
    float begin_, end_;             // of their intervals
    uint32_t count_ = 0;
    // One array a component, with room for a packet behind the last entry.
    std::vector<uint32_t> ray_;
    std::vector<float> origin_[3]; // if the rays do not start at the light
    std::vector<float> direction_[3];
    std::vector<float> light_[3];
    std::vector<float> t_min_, t_max_, cost_;
    std::vector<uint8_t> occluded_;
};

} // namespace mlrt
