// Shadow rays: which samples of lights are visible.
#pragma once

#include "base/counters.h"
#include "mlrta/trace.h"
#include "render/prepared_scene.h"

#include <cstdint>
#include <span>
#include <vector>

namespace mlrt {

// Light that reaches a point unless something is in the way.
struct ShadowCandidate {
    uint32_t ray = 0; // which camera ray it is for
    uint32_t emitter = 0;
    Vec3f origin{}; // off the surface: see shadow_offset.h
    Vec3f target{}; // on the light, or beyond the scene for a directional one
    Vec3f contribution{};
};

// Calls visible(candidate) for those that nothing occludes, each emitter's in the order
// given.
//
// The rays of one emitter are traced as one group. For point and spot lights they start at
// the light, so that they share an origin and form a beam; the interval leaves out the same
// share at the light's end as in Mitsuba, where they run the other way.
class ShadowTracer {
public:
    ShadowTracer(const PreparedScene &scene, const TraceOptions &options,
                 Counters &counters)
        : scene_(scene), options_(options), counters_(counters) {}

    template <typename Visible>
    void trace(std::span<const ShadowCandidate> candidates, Visible &&visible) {
        sort_by_emitter(candidates);
        for (size_t begin = 0; begin < order_.size();) {
            const uint32_t emitter = candidates[order_[begin]].emitter;
            size_t end = begin;
            while (end < order_.size() && candidates[order_[end]].emitter == emitter)
                ++end;
            const std::span<const uint32_t> group(order_.data() + begin, end - begin);
            trace_group(candidates, group, scene_.data.emitters[emitter]);
            for (size_t i = 0; i < group.size(); ++i)
                if (!occluded_[i])
                    visible(candidates[group[i]]);
            begin = end;
        }
    }

private:
    void sort_by_emitter(std::span<const ShadowCandidate> candidates);
    void trace_group(std::span<const ShadowCandidate> candidates,
                     std::span<const uint32_t> group, const Emitter &emitter);

    const PreparedScene &scene_;
    const TraceOptions &options_;
    Counters &counters_;
    std::vector<uint32_t> order_; // of the candidates, by emitter
    std::vector<uint32_t> next_;  // of each emitter: the next free place in order_
    std::vector<float> origin_[3], direction_[3], t_min_, t_max_;
    std::vector<uint8_t> occluded_;
};

} // namespace mlrt
