#include "render/distribution.h"

#include <algorithm>

namespace mlrt {

Distribution::Distribution(std::span<const float> weights)
    : weights_(weights.begin(), weights.end()), cumulative_(weights.size()) {
    double sum = 0;
    bool any = false;
    for (uint32_t i = 0; i < weights_.size(); ++i) {
        sum += weights_[i];
        cumulative_[i] = float(sum);
        if (weights_[i] > 0) {
            first_ = any ? first_ : i;
            last_ = i;
            any = true;
        }
    }
    sum_ = float(sum);
    normalization_ = any ? 1.0f / sum_ : 0.0f;
}

Distribution::Choice Distribution::choose(float random) const {
    const float target = random * sum_;
    const auto begin = cumulative_.begin();
    const auto found = std::lower_bound(begin + first_, begin + last_, target);
    const uint32_t index = uint32_t(found - begin);
    const float probability = weights_[index] * normalization_;
    const float before = index > 0 ? cumulative_[index - 1] * normalization_ : 0.0f;
    return {index, (random - before) / probability, probability};
}

// The first entry that is not less than the target is as many behind the first as are less:
// where one is, the next takes its place.
Distribution::Choices Distribution::choose(const FloatPacket &random) const {
    const FloatPacket target = random * sum_;
    const auto before = [&](uint32_t i) {
        return FloatPacket(i > 0 ? cumulative_[i - 1] * normalization_ : 0.0f);
    };
    UIntPacket index(first_);
    FloatPacket probability(weights_[first_] * normalization_), start = before(first_);
    for (uint32_t i = first_; i < last_; ++i) {
        const LaneBits less = to_bits(FloatPacket(cumulative_[i]) < target);
        const auto beyond = from_bits<FloatPacket>(less);
        index = select(from_bits<UIntPacket>(less), UIntPacket(i + 1), index);
        probability =
            select(beyond, FloatPacket(weights_[i + 1] * normalization_), probability);
        start = select(beyond, before(i + 1), start);
    }
    return {index, (random - start) / probability, probability};
}

} // namespace mlrt
