// Packets or single rays: which is faster where rays have little in common.
#pragma once

#include "base/counters.h"

#include <cstdint>

namespace mlrt {

// How rays are traced, where it is chosen: sixteen at a time, one at a time, or one at a
// time through the wide tree.
enum class Way { packet, single, wide };

// Judges by what both took of the rays before. Neighbours should be much alike: a share of
// the rays goes the slower way, so that a change is noticed.
class PacketsOrSingles {
public:
    // Rays that are traced one way before the next choice; chosen.
    static constexpr uint32_t RAYS = 64;

    bool choose_singles() {
        ++choices_;
        if (packets_.rays == 0 || singles_.rays == 0)
            return packets_.rays > 0;
        const bool singles = singles_.cost < packets_.cost;
        return (choices_ % CHECK_EVERY == 0) != singles;
    }

    // What some rays took the way that was chosen, by the counters before and after.
    void learn(Way way, const Counters &before, const Counters &after) {
        const uint64_t rays = after.rays - before.rays;
        if (rays == 0)
            return;
        const auto [of_ray, of_step, of_test] = costs(way);
        const float steps = float(after.traversal_steps - before.traversal_steps);
        const float tests = float(after.triangle_tests - before.triangle_tests);
        const float cost = of_ray + (of_step * steps + of_test * tests) / float(rays);
        Experience &own = way == Way::packet ? packets_ : singles_;
        own.cost += (own.rays == 0 ? 1.0f : 0.5f) * (cost - own.cost);
        own.rays += rays;
    }

private:
    // In nanoseconds.
    struct Costs {
        float ray, step, test;
    };

    // Fitted to rays to area lights and skies in conference and sponza (AVX-512); those of
    // the wide tree estimated from a profile of bounces in conference.
    static constexpr Costs costs(Way way) {
        switch (way) {
        case Way::packet:
            return {0, 20, 25};
        case Way::single:
            return {50, 10, 8};
        case Way::wide:
            break;
        }
        return {40, 8, 3};
    }

    static constexpr uint32_t CHECK_EVERY = 32;

    struct Experience {
        uint64_t rays = 0;
        float cost = 0; // of a ray; a moving average
    };
    Experience packets_, singles_;
    uint32_t choices_ = 0;
};

} // namespace mlrt
