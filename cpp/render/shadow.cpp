#include "render/shadow.h"

#include "render/shadow_offset.h"

#include <numeric>

namespace mlrt {

// A counting sort: it keeps the order of each emitter's candidates.
void ShadowTracer::sort_by_emitter(std::span<const ShadowCandidate> candidates) {
    next_.assign(scene_.data.emitters.size() + 1, 0);
    for (const ShadowCandidate &candidate : candidates)
        ++next_[candidate.emitter + 1];
    std::partial_sum(next_.begin(), next_.end(), next_.begin());
    order_.resize(candidates.size());
    for (uint32_t i = 0; i < candidates.size(); ++i)
        order_[next_[candidates[i].emitter]++] = i;
}

void ShadowTracer::trace_group(std::span<const ShadowCandidate> candidates,
                               std::span<const uint32_t> group, const Emitter &emitter) {
    const size_t count = group.size();
    const bool from_light =
        emitter.type == EmitterType::point || emitter.type == EmitterType::spot;
    for (int k = 0; k < 3; ++k) {
        origin_[k].resize(from_light ? 0 : count);
        direction_[k].resize(count);
        for (size_t i = 0; i < count; ++i) {
            const ShadowCandidate &candidate = candidates[group[i]];
            const float reach = candidate.target[k] - candidate.origin[k];
            direction_[k][i] = from_light ? -reach : reach;
            if (!from_light)
                origin_[k][i] = candidate.origin[k];
        }
    }
    t_min_.assign(count, from_light ? SHADOW_EPSILON : 0.0f);
    t_max_.assign(count, from_light ? 1.0f : 1.0f - SHADOW_EPSILON);
    occluded_.resize(count);

    RayGroup rays;
    rays.count = uint32_t(count);
    rays.has_common_origin = from_light;
    rays.common_origin = emitter.position;
    for (int k = 0; k < 3; ++k) {
        rays.origin[k] = from_light ? nullptr : origin_[k].data();
        rays.direction[k] = direction_[k].data();
    }
    rays.t_min = t_min_.data();
    rays.t_max = t_max_.data();
    trace_any(*scene_.data.tree, rays, options_, occluded_.data(), counters_);
}

} // namespace mlrt
