// How many triangles a beam may be tested against before it is given up.
#pragma once

#include "base/check.h"

#include <cstdint>
#include <limits>

namespace mlrt {

class BeamBudget {
public:
    // Gives a beam up that was tested against `most_triangles`.
    explicit BeamBudget(uint32_t most_triangles) : most_triangles_(most_triangles) {}
    // Also one that finds little: after `first_look` triangles, one at least, and whenever
    // there are twice as many, fewer than `least_yield` of its rays a triangle have found
    // something.
    BeamBudget(uint32_t most_triangles, uint32_t first_look, float least_yield)
        : most_triangles_(most_triangles), next_look_(first_look),
          least_yield_(least_yield) {
        MLRT_CHECK(first_look > 0);
    }

    static BeamBudget without_end() {
        return BeamBudget(std::numeric_limits<uint32_t>::max());
    }

    // Takes what was tested. `count_found` tells how many rays have found something; it is
    // asked seldom.
    template <typename CountFound>
    void spend(uint32_t triangles, CountFound &&count_found) {
        tested_ += triangles;
        if (tested_ < next_look_)
            return;
        while (next_look_ <= tested_)
            next_look_ *= 2;
        finds_little_ |= float(count_found()) < least_yield_ * float(tested_);
    }

    uint64_t tested() const { return tested_; }
    // Whether the beam had better be given up.
    bool spent() const { return tested_ >= most_triangles_ || finds_little_; }

private:
    uint64_t tested_ = 0;
    uint64_t most_triangles_;
    uint64_t next_look_ = std::numeric_limits<uint64_t>::max();
    float least_yield_ = 0;
    bool finds_little_ = false;
};

} // namespace mlrt
