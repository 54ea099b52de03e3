// Shares what tracing takes among the rays that it is done for, where that is asked for.
#pragma once

#include "base/counters.h"
#include "base/simd.h"
#include "traverse/ray_group.h"

#include <bit>

namespace mlrt {

class RayCost {
public:
    RayCost(const RayGroup &rays, const Counters &counters)
        : cost_(rays.cost), counters_(counters), before_(cost_ ? counters.work() : 0) {}

    // What was done since the last call, or since this was made, per ray of `count`.
    float share(uint32_t count) {
        if (!cost_)
            return 0;
        const uint64_t now = counters_.work();
        const float share = float(now - before_) / float(count);
        before_ = now;
        return share;
    }

    void add_to_run(uint32_t first, uint32_t count) {
        if (const float own = share(count); own > 0)
            for (uint32_t i = first; i < first + count; ++i)
                cost_[i] += own;
    }
    void add_to_lanes(uint32_t first, LaneBits lanes) {
        if (const float own = share(uint32_t(std::popcount(lanes))); own > 0)
            add_to_lanes(first, lanes, own);
    }
    void add_to_lanes(uint32_t first, LaneBits lanes, float own) {
        if (cost_)
            for_each_lane(lanes, [&](uint32_t lane) { cost_[first + lane] += own; });
    }

private:
    float *cost_;
    const Counters &counters_;
    uint64_t before_;
};

} // namespace mlrt
