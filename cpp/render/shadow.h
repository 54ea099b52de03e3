// Shadow rays: which samples of lights are visible.
#pragma once

#include "base/counters.h"
#include "base/simd.h"
#include "mlrta/trace.h"
#include "render/prepared_scene.h"
#include "render/shadow_offset.h"

#include <cstdint>
#include <span>
#include <vector>

namespace mlrt {

// Light that reaches points unless something is in the way. One array a component, with
// room for a packet behind the last entry.
struct ShadowCandidates {
    uint32_t count = 0;
    std::vector<uint32_t> ray; // which camera ray it is for
    std::vector<uint32_t> emitter;
    std::vector<float> origin[3];    // off the surface: see shadow_offset.h
    std::vector<float> direction[3]; // to the light, or beyond the scene for one far away
    std::vector<float> contribution[3];

    // Empties the arrays and makes room for a number of entries.
    void reset(size_t capacity);

    // Adds the lanes whose bit is set.
    void append(LaneBits lanes, const LaneArray<uint32_t> &of_ray,
                const LaneArray<uint32_t> &to_emitter, const Vec3<FloatPacket> &from,
                const Vec3<FloatPacket> &to, const Vec3<FloatPacket> &light);
};

// Calls visible(i) for the candidates i that nothing occludes, each emitter's in the order
// given.
//
// The rays of one emitter are traced as one group. For point and spot lights they start at
// the light, so that they share an origin and form a beam; the interval leaves out the same
// share at the light's end as in Mitsuba, where they run the other way. With robust offsets
// it leaves out nothing, and lights that are far away are traced from the surfaces.
class ShadowTracer {
public:
    ShadowTracer(const PreparedScene &scene, const TraceOptions &options,
                 ShadowOffset offset, Counters &counters)
        : scene_(scene), options_(options), offset_(offset), counters_(counters) {}

    template <typename Visible>
    void trace(const ShadowCandidates &candidates, Visible &&visible) {
        sort_by_emitter(candidates);
        if (keep_costs_)
            costs_.assign(candidates.count, 0.0f);
        for (uint32_t begin = 0; begin < candidates.count;) {
            const uint32_t emitter = candidates.emitter[order_[begin]];
            uint32_t end = begin;
            while (end < candidates.count && candidates.emitter[order_[end]] == emitter)
                ++end;
            const std::span<const uint32_t> group(order_.data() + begin, end - begin);
            trace_group(candidates, group, emitter,
                        keep_costs_ ? costs_.data() + begin : nullptr);
            for (size_t i = 0; i < group.size(); ++i)
                if (!occluded_[i])
                    visible(group[i]);
            begin = end;
        }
    }

    // Whether trace() is to keep account of what each ray takes, and adding that to the
    // camera rays' own.
    void keep_costs(bool keep) { keep_costs_ = keep; }
    void add_costs_to(const ShadowCandidates &candidates, float *of_camera_rays) const;

private:
    void sort_by_emitter(const ShadowCandidates &candidates);
    void trace_group(const ShadowCandidates &candidates, std::span<const uint32_t> group,
                     uint32_t number, float *costs);

    const PreparedScene &scene_;
    const TraceOptions &options_;
    ShadowOffset offset_;
    Counters &counters_;
    std::vector<uint32_t> order_; // of the candidates, by emitter
    std::vector<uint32_t> next_;  // of each emitter: the next free place in order_
    std::vector<float> origin_[3], direction_[3], t_min_, t_max_;
    std::vector<uint8_t> occluded_;
    bool keep_costs_ = false;
    std::vector<float> costs_; // in the order of order_
};

} // namespace mlrt
