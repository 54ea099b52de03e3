// A choice among finitely many things with given weights.
#pragma once

#include "base/simd.h"

#include <cstdint>
#include <span>
#include <vector>

namespace mlrt {

// As Mitsuba's DiscreteDistribution, so that equal random numbers choose equal things.
class Distribution {
public:
    struct Choice {
        uint32_t index;
        float reused; // the random number made uniform again
        float probability;
    };

    Distribution() = default;
    explicit Distribution(std::span<const float> weights);

    bool empty() const { return cumulative_.empty(); }

    // 1 / sum of the weights; 0 if there is no weight at all.
    float normalization() const { return normalization_; }

    float probability(uint32_t index) const { return weights_[index] * normalization_; }

    // Needs a positive sum of weights. `random` is in [0, 1).
    Choice choose(float random) const;

    // The same for sixteen numbers at once.
    struct Choices {
        UIntPacket index;
        FloatPacket start, probability; // of the numbers that choose the same

        // The random numbers made uniform again.
        FloatPacket reused(const FloatPacket &random) const {
            return (random - start) / probability;
        }
    };
    Choices choose(const FloatPacket &random) const;

    // The same without what belongs to it: where there are few things.
    UIntPacket index_of(const FloatPacket &random) const {
        const FloatPacket target = random * sum_;
        UIntPacket index(first_);
        for (uint32_t i = first_; i < last_; ++i) {
            const LaneBits less = to_bits(FloatPacket(cumulative_[i]) < target);
            index = select(from_bits<UIntPacket>(less), UIntPacket(i + 1), index);
        }
        return index;
    }

private:
    Choices choose_by_comparing_all(const FloatPacket &random) const;
    Choices choose_by_bisection(const FloatPacket &random) const;

    std::vector<float> weights_;
    std::vector<float> cumulative_;
    uint32_t first_ = 0, last_ = 0; // the outermost entries with a positive weight
    float sum_ = 0;
    float normalization_ = 0;
};

} // namespace mlrt
