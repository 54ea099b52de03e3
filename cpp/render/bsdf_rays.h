// Rays that materials send out to find lights.
#pragma once

#include "base/counters.h"
#include "base/simd.h"
#include "mlrta/trace.h"
#include "render/bsdf_sampling.h"
#include "render/face_cache.h"
#include "render/prepared_scene.h"

#include <cstdint>
#include <span>
#include <vector>

namespace mlrt {

// How light is shared between the samples of emitters and those of materials (Mitsuba 3.9's
// direct.cpp): the part of all samples that each are, and the weight of one sample among
// its kind.
struct SampleShares {
    float emitters, bsdfs;
    float emitter_weight, bsdf_weight;

    SampleShares(uint32_t emitter_samples, uint32_t bsdf_samples);
};

// Whether rays are only traced if they meet something that glows.
inline bool looks_for_light_first(const PreparedScene &scene) {
    return !scene.environment.exists() && scene.glowing.of(scene.data);
}

// Rays in no order. What they bring back is weighed by the power heuristic against emitter
// samples.
class BsdfRays {
public:
    BsdfRays(const PreparedScene &scene, const SampleShares &shares)
        : scene_(scene), shares_(shares), faces_(scene, scene.plane.origin) {}

    void clear() { count_ = 0; }

    // Adds the samples' lanes. `start` lies off the surface, `p` on it; `ray` is the camera
    // ray that they are for.
    void append(const BsdfSamples &samples, const UIntPacket &ray,
                const Vec3<FloatPacket> &start, const Vec3<FloatPacket> &p);

    // Adds the light that arrives to colours[k][ray], in the order given, and what tracing
    // takes to cost[ray] if `cost` is given.
    void trace(const TraceOptions &options, Counters &counters, float *cost,
               std::span<float *const, 3> colours);

private:
    void reserve(size_t size);
    RayGroup group(float *cost);
    void add_cost(float *cost) const;
    void leave_out_dark(const TraceOptions &options, Counters &counters, float *cost);
    void find_hits(const TraceOptions &options, Counters &counters, float *cost);
    Vec3<FloatPacket> light_from_shapes(size_t first, LaneBits hits);
    Vec3<FloatPacket> light_from_around(size_t first, LaneBits misses) const;
    Vec3<FloatPacket> vector(const std::vector<float> (&of)[3], size_t first) const;

    const PreparedScene &scene_;
    SampleShares shares_;
    FaceCache faces_;
    uint32_t count_ = 0;
    // One array a component, with room for a packet behind the last entry.
    std::vector<uint32_t> ray_;
    std::vector<float> start_[3], p_[3], direction_[3], weight_[3];
    std::vector<float> density_, cost_;
    // What the rays meet; distances and instances only if the scene has objects.
    std::vector<uint32_t> primitive_, instance_;
    std::vector<float> t_;
    std::vector<uint8_t> blocked_; // in place of these where nothing glows
};

} // namespace mlrt
