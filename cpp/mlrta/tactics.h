// Packets or single rays: which is faster where rays have little in common.
#pragma once

#include "base/counters.h"

#include <cstdint>

namespace mlrt {

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
    void learn(bool singles, const Counters &before, const Counters &after) {
        const uint64_t rays = after.rays - before.rays;
        if (rays == 0)
            return;
        Way &way = singles ? singles_ : packets_;
        const float steps = float(after.traversal_steps - before.traversal_steps);
        const float tests = float(after.triangle_tests - before.triangle_tests);
        const float cost =
            singles ? SINGLE_RAY + (SINGLE_STEP * steps + SINGLE_TEST * tests) / float(rays)
                    : (PACKET_STEP * steps + PACKET_TEST * tests) / float(rays);
        way.cost += (way.rays == 0 ? 1.0f : 0.5f) * (cost - way.cost);
        way.rays += rays;
    }

private:
    // In nanoseconds, fitted to rays to area lights and skies in conference and sponza
    // (AVX-512).
    static constexpr float PACKET_STEP = 20, PACKET_TEST = 25;
    static constexpr float SINGLE_RAY = 50, SINGLE_STEP = 10, SINGLE_TEST = 8;
    static constexpr uint32_t CHECK_EVERY = 32;

    struct Way {
        uint64_t rays = 0;
        float cost = 0; // of a ray; a moving average
    };
    Way packets_, singles_;
    uint32_t choices_ = 0;
};

} // namespace mlrt
